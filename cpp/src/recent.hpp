/// What several objects share while one of them lives; private to the runtime.
#pragma once

#include <array>
#include <memory>
#include <mutex>

namespace supple {

/// The newest few of what is made; nothing is kept alive.
template <class T>
class Recent {
 public:
  /// One that `matches`, or what `make` gives: a std::shared_ptr<const T>. One thread at a time.
  template <class Matches, class Make>
  std::shared_ptr<const T> find(Matches matches, Make make) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const std::weak_ptr<const T>& one : known_)
      if (const std::shared_ptr<const T> k = one.lock(); k && matches(*k)) return k;
    const std::shared_ptr<const T> fresh = make();
    known_[oldest_++ % known_.size()] = fresh;
    return fresh;
  }

 private:
  std::mutex mutex_;
  std::array<std::weak_ptr<const T>, 4> known_;
  std::size_t oldest_ = 0;
};

} // namespace supple
