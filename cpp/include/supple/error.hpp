/// The exceptions that the runtime throws; every message names argument, expected, got and remedy.
#pragma once

#include <stdexcept>
#include <string>

namespace supple {

/// Root of all exceptions of the runtime.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An array has the wrong size, or an index points outside of what it indexes.
class ShapeError : public Error {
 public:
  using Error::Error;
};

/// A value that is no number, or a computation that cannot go on (memory, library failure).
class NumericalError : public Error {
 public:
  using Error::Error;
};

/// A call that came before the one that it depends on (solve before factorise).
class StateError : public Error {
 public:
  using Error::Error;
};

/// Throw ShapeError unless `got == expected`; `what` names the argument, `remedy` says what to do.
inline void require_size(const char* what, long long got, long long expected, const char* remedy) {
  if (got == expected) return;
  throw ShapeError(std::string(what) + " must have size " + std::to_string(expected) + ", got " +
                   std::to_string(got) + "; " + remedy);
}

} // namespace supple
