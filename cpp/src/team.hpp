/// Threads that go through the same code together and share out its loops; private to the runtime.
#pragma once

#include <atomic>
#include <thread>

namespace supple {

/// What the threads of a team have in common.
class Team {
 public:
  /// For `size` threads; not while any of them is inside.
  void reset(int size) {
    size_ = size;
    arrived_ = 0;
    next_ = 0;
  }
  int size() const { return size_; }

  /// The next of the things that are shared out since the last wait.
  int take() { return next_.fetch_add(1, std::memory_order_relaxed); }

  /// Until all have arrived; what they wrote before, all can read behind.
  void wait() {
    const unsigned epoch = epoch_.load(std::memory_order_acquire);
    if (arrived_.fetch_add(1, std::memory_order_acq_rel) + 1 == size_) {
      arrived_.store(0, std::memory_order_relaxed);
      next_.store(0, std::memory_order_relaxed);
      epoch_.store(epoch + 1, std::memory_order_release);
      return;
    }
    // Spins for some microseconds, the length of a wait; then leaves the core to whoever is late.
    for (int turn = 0; epoch_.load(std::memory_order_acquire) == epoch; ++turn)
      if (turn > kSpins) std::this_thread::yield();
  }

 private:
  static constexpr int kSpins = 4000;
  int size_ = 1;
  std::atomic<int> arrived_{0}, next_{0};
  std::atomic<unsigned> epoch_{0};
};

/// One thread of a team, or a thread alone.
struct Worker {
  int number = 0;
  Team* team = nullptr;

  /// use(i) for i in [0, count), each by one thread; all are done when any returns.
  template <class Use>
  void share(int count, const Use& use) const {
    if (team == nullptr) {
      for (int i = 0; i < count; ++i)
        use(i);
      return;
    }
    for (int i = team->take(); i < count; i = team->take())
      use(i);
    team->wait();
  }
  /// use() by one thread; all see what it did.
  template <class Use>
  void once(const Use& use) const {
    share(1, [&](int) { use(); });
  }
};

} // namespace supple
