/// Vectors and strips, and the solves with a factor, for one width of vectors. Included once by
/// each instruction set's unit in an unnamed namespace, and includes nothing: a function shared
/// between units would be the one of whichever instruction set the linker takes.

template <class T>
struct IntegerLike;
template <>
struct IntegerLike<float> {
  using type = std::int32_t;
};
template <>
struct IntegerLike<double> {
  using type = std::int64_t;
};

template <class T, int Bytes>
struct StripSolves {
  static constexpr int S = Bytes / static_cast<int>(sizeof(T)); ///< lanes
  using Lane = typename IntegerLike<T>::type;
  typedef T V __attribute__((vector_size(Bytes), may_alias));
  typedef Lane L __attribute__((vector_size(Bytes), may_alias));

  static V load(const T* at) { return *reinterpret_cast<const V*>(at); }
  static void store(T* at, V value) { *reinterpret_cast<V*>(at) = value; }
  static Index least(Index a, Index b) { return a < b ? a : b; }
  static T* strip(T* panel, Index k, Index s) {
    return panel + static_cast<std::int64_t>(s) * S * k;
  }
  static const T* strip(const T* panel, Index k, Index s) {
    return panel + static_cast<std::int64_t>(s) * S * k;
  }

  /// Σ_j strip(:, j) x_j of R strips, R·4 sums at once.
  template <int R>
  static void apply(V (&sum)[R], const T* first, std::int64_t next, const T* x, Index k) {
    V part[R][4] = {};
    Index j = 0;
    for (; j + 4 <= k; j += 4)
#pragma GCC unroll 4
      for (int i = 0; i < 4; ++i)
#pragma GCC unroll 4
        for (int r = 0; r < R; ++r)
          part[r][i] += load(first + r * next + (j + i) * S) * x[j + i];
    for (; j < k; ++j)
#pragma GCC unroll 4
      for (int r = 0; r < R; ++r)
        part[r][0] += load(first + r * next + j * S) * x[j];
    for (int r = 0; r < R; ++r)
      sum[r] = (part[r][0] + part[r][1]) + (part[r][2] + part[r][3]);
  }

  static void forward(const T* panel, Index k, Index strips, T* x, T* below) {
    const Index diagonal = (k + S - 1) / S;
    const std::int64_t next = static_cast<std::int64_t>(S) * k;
    for (Index s = 0; s < diagonal; ++s) {
      const T* const own = strip(panel, k, s);
      V sum[1];
      apply<1>(sum, own, next, x, s * S);
      V values = load(x + s * S) - sum[0];
      const Index width = least(S, k - s * S);
      for (Index i = 0; i < width; ++i) {
        const V column = load(own + (s * S + i) * S);
        const T solved = values[i] * column[i];
        values -= column * solved;
        values[i] = solved;
      }
      store(x + s * S, values);
    }
    Index s = 0;
    for (; s + 2 <= strips; s += 2) {
      V sum[2];
      apply<2>(sum, strip(panel, k, diagonal + s), next, x, k);
      store(below + s * S, load(below + s * S) - sum[0]);
      store(below + (s + 1) * S, load(below + (s + 1) * S) - sum[1]);
    }
    if (s < strips) {
      V sum[1];
      apply<1>(sum, strip(panel, k, diagonal + s), next, x, k);
      store(below + s * S, load(below + s * S) - sum[0]);
    }
  }

  /// work[j] += Σ_r strip_r(:, j) y_r, lane by lane.
  template <int R>
  static void gather(T* work, const T* first, std::int64_t next, const T* y, Index k) {
    V value[R];
#pragma GCC unroll 4
    for (int r = 0; r < R; ++r)
      value[r] = load(y + r * S);
    for (Index j = 0; j < k; ++j) {
      V sum = load(work + j * S);
#pragma GCC unroll 4
      for (int r = 0; r < R; ++r)
        sum += load(first + r * next + j * S) * value[r];
      store(work + j * S, sum);
    }
  }

  static T total(V v) {
    T sum = 0;
#pragma GCC unroll 16
    for (int i = 0; i < S; ++i)
      sum += v[i];
    return sum;
  }

  static void backward(const T* panel, Index k, Index strips, T* x, const T* below, T* work) {
    const Index diagonal = (k + S - 1) / S;
    const std::int64_t next = static_cast<std::int64_t>(S) * k;
    for (Index j = 0; j < k; ++j)
      store(work + j * S, V{});
    Index s = 0;
    for (; s + 4 <= strips; s += 4)
      gather<4>(work, strip(panel, k, diagonal + s), next, below + s * S, k);
    for (; s < strips; ++s)
      gather<1>(work, strip(panel, k, diagonal + s), next, below + s * S, k);
    for (Index t = diagonal - 1; t >= 0; --t) {
      const T* const own = strip(panel, k, t);
      V values{};
      for (Index i = least(S, k - t * S) - 1; i >= 0; --i) {
        const V column = load(own + (t * S + i) * S); // values is zero up to lane i
        const T sum = total(load(work + (t * S + i) * S) + column * values);
        values[i] = (x[t * S + i] - sum) * column[i];
      }
      store(x + t * S, values);
      gather<1>(work, own, next, x + t * S, t * S);
    }
  }
};
