/// Threads that go through the same code together and share out its loops; private to the runtime.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

namespace supple {

/// Which loop is being shared out, and how far it is. A loop is over when its parts are done, not
/// when all threads have come by: one that is late, for the core was given to another program,
/// passes over what is over.
class Team {
 public:
  /// Begin anew; not while any thread is inside.
  void reset() {
    ticket_ = 0;
    done_ = 0;
  }

  /// use(i) for i in [0, count) as loop number `loop`, each by one thread; all are done on return.
  template <class Use>
  void share(std::uint64_t loop, std::uint64_t count, const Use& use) {
    std::uint64_t ticket = ticket_.load(std::memory_order_acquire);
    while (ticket >> kBits == loop && (ticket & kMask) < count) {
      if (!ticket_.compare_exchange_weak(ticket, ticket + 1, std::memory_order_acq_rel)) continue;
      use(static_cast<int>(ticket & kMask));
      if (done_.fetch_add(1, std::memory_order_acq_rel) + 1 == count) finish(loop);
      ticket = ticket_.load(std::memory_order_acquire);
    }
    // Spins for some microseconds, the length of a wait; then leaves the core to whoever is late.
    for (int turn = 0; ticket_.load(std::memory_order_acquire) >> kBits <= loop; ++turn)
      if (turn > kSpins) std::this_thread::yield();
  }

 private:
  static constexpr int kSpins = 4000, kBits = 24;
  static constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;

  void finish(std::uint64_t loop) {
    done_.store(0, std::memory_order_relaxed);
    ticket_.store((loop + 1) << kBits, std::memory_order_release);
  }

  std::atomic<std::uint64_t> ticket_{0}; ///< the loop, and below kBits the next of its parts
  std::atomic<std::uint64_t> done_{0};   ///< parts of this loop
};

/// One thread of a team, or a thread alone.
struct Worker {
  int number = 0;
  Team* team = nullptr;
  std::uint64_t loops = 0; ///< that it has seen

  /// use(i) for i in [0, count), each by one thread; all are done when any returns.
  template <class Use>
  void share(int count, const Use& use) {
    if (team != nullptr && count > 0)
      return team->share(loops++, static_cast<std::uint64_t>(count), use);
    for (int i = 0; i < count; ++i)
      use(i);
  }
  /// use() by one thread; all see what it did.
  template <class Use>
  void once(const Use& use) {
    share(1, [&](int) { use(); });
  }
};

} // namespace supple
