/// The smallest test frame that we need: TEST registers, CHECK reports and goes on, run_tests
/// counts.
#pragma once

#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace check {

struct State {
  std::vector<std::pair<std::string, void (*)()>> tests;
  int failures = 0;
};

inline State& state() {
  static State instance;
  return instance;
}

inline bool add(const char* name, void (*test)()) {
  state().tests.emplace_back(name, test);
  return true;
}

inline void report(bool good, const char* what, const char* file, int line,
                   const std::string& why) {
  if (good) return;
  ++state().failures;
  std::fprintf(stderr, "%s:%d: %s failed%s%s\n", file, line, what, why.empty() ? "" : ": ",
               why.c_str());
}

inline int run_tests() {
  for (const auto& [name, test] : state().tests) {
    const int before = state().failures;
    try {
      test();
    } catch (const std::exception& error) {
      report(false, name.c_str(), "unexpected exception", 0, error.what());
    }
    std::printf("%s  %s\n", state().failures == before ? "ok  " : "FAIL", name.c_str());
  }
  return state().failures == 0 && !state().tests.empty() ? 0 : 1;
}

} // namespace check

#define TEST(name)                                                                                 \
  static void name();                                                                              \
  [[maybe_unused]] static const bool name##_added = check::add(#name, name);                       \
  static void name()
#define CHECK(condition)                                                                           \
  check::report(static_cast<bool>(condition), #condition, __FILE__, __LINE__, "")
#define CHECK_BELOW(value, limit)                                                                  \
  check::report((value) <= (limit), #value " <= " #limit, __FILE__, __LINE__,                      \
                "got " + std::to_string(value) + " (" + std::to_string((value) / (limit)) +        \
                    " of the limit)")
#define CHECK_THROWS(expression, Exception)                                                        \
  do {                                                                                             \
    bool caught = false;                                                                           \
    try {                                                                                          \
      expression;                                                                                  \
    } catch (const Exception&) {                                                                   \
      caught = true;                                                                               \
    }                                                                                              \
    check::report(caught, #expression " throws " #Exception, __FILE__, __LINE__, "");              \
  } while (false)

int main() {
  return check::run_tests();
}
