/// The kernels of strips.hpp for one width of vectors: elimination and update. Included as
/// strips_solve.hpp is, behind it.

template <class T, int Bytes, int Columns>
struct Strips : StripSolves<T, Bytes> {
  using Base = StripSolves<T, Bytes>;
  using Base::S, Base::load, Base::store, Base::strip, Base::least;
  using typename Base::L, typename Base::Lane, typename Base::V;
  static constexpr int N = Columns; ///< columns of a tile, N divides S

  /// sum[r][j] = Σ_p a[r](p) b(p, j): the loop where nearly all of the work is done.
  template <int R, int W>
  static inline __attribute__((always_inline)) void product(V (&sum)[R][W], const T* const (&a)[R],
                                                            const T* b, Index depth) {
#pragma GCC unroll 4
    for (int r = 0; r < R; ++r)
#pragma GCC unroll 8
      for (int j = 0; j < W; ++j)
        sum[r][j] = V{};
    for (Index p = 0; p < depth; ++p) {
      V row[R];
#pragma GCC unroll 4
      for (int r = 0; r < R; ++r)
        row[r] = load(a[r] + p * S);
#pragma GCC unroll 8
      for (int j = 0; j < W; ++j) {
        const T factor = b[p * S + j];
#pragma GCC unroll 4
        for (int r = 0; r < R; ++r)
          sum[r][j] += row[r] * factor;
      }
    }
  }

  /// C −= A Bᵀ, or C = −A Bᵀ, of which the first `width` columns count.
  template <int R, bool Fresh>
  static void tile(T* const (&c)[R], const T* const (&a)[R], const T* b, Index depth, Index width) {
    V sum[R][N];
    product<R, N>(sum, a, b, depth);
#pragma GCC unroll 8
    for (int j = 0; j < N; ++j) {
      if (j >= width) break;
#pragma GCC unroll 4
      for (int r = 0; r < R; ++r)
        store(c[r] + j * S, Fresh ? -sum[r][j] : load(c[r] + j * S) - sum[r][j]);
    }
  }

  /// The same for the `count` ≤ 3 strips that begin at `s`.
  template <bool Fresh, class Target>
  static void tiles(const Target& target, const T* a, Index k, Index s, Index count, const T* b,
                    Index depth, Index width) {
    const T* const first = strip(a, k, s);
    const std::int64_t next = static_cast<std::int64_t>(S) * k;
    if (count == 3)
      tile<3, Fresh>({target(s), target(s + 1), target(s + 2)},
                     {first, first + next, first + 2 * next}, b, depth, width);
    else if (count == 2)
      tile<2, Fresh>({target(s), target(s + 1)}, {first, first + next}, b, depth, width);
    else
      tile<1, Fresh>({target(s)}, {first}, b, depth, width);
  }

  static void update(T* panel, Index k, Run strips, Run columns) {
    for (Index p = 0; p < columns.begin; p += kDepth) {
      const Index depth = least(kDepth, columns.begin - p);
      for (Index j = columns.begin; j < columns.end; j += N) {
        const T* const b = strip(panel, k, j / S) + p * S + j % S;
        const auto target = [&](Index s) { return strip(panel, k, s) + j * S; };
        for (Index s = strips.begin; s < strips.end; s += 3)
          tiles<false>(target, panel + p * S, k, s, least(3, strips.end - s), b, depth,
                       least(N, columns.end - j));
      }
    }
  }

  static void outer(T* triangle_, const T* below, Index k, Run strips) {
    for (Index p = 0; p < k; p += kDepth) {
      const Index depth = least(kDepth, k - p);
      for (Index j = 0; j < strips.end * S; j += N) {
        const Index first = j / S; // the strip in which these columns have their diagonal
        const T* const b = strip(below, k, first) + p * S + j % S;
        const auto target = [&](Index s) { return triangle_ + triangle(s, S) + j * S; };
        for (Index s = first > strips.begin ? first : strips.begin; s < strips.end; s += 3) {
          const Index count = least(3, strips.end - s);
          if (p == 0)
            tiles<true>(target, below + p * S, k, s, count, b, depth, N);
          else
            tiles<false>(target, below + p * S, k, s, count, b, depth, N);
        }
      }
    }
  }

  /// Columns [j, j + width) of R strips: what the block's columns before them leave, divided.
  template <int R>
  static void divide_tile(T* const (&c)[R], const T* diagonal, Index begin, Index j, Index width) {
    V x[R][N];
    const T* a[R];
#pragma GCC unroll 4
    for (int r = 0; r < R; ++r)
      a[r] = c[r] + begin * S;
    product<R, N>(x, a, diagonal + begin * S + j % S, j - begin);
#pragma GCC unroll 8
    for (int i = 0; i < N; ++i)
#pragma GCC unroll 4
      for (int r = 0; r < R; ++r)
        x[r][i] = load(c[r] + (j + i) * S) - x[r][i];
    const T* const l = diagonal + j * S + j % S;
#pragma GCC unroll 8
    for (int i = 0; i < N; ++i) {
      if (i >= width) break;
#pragma GCC unroll 4
      for (int r = 0; r < R; ++r) {
        x[r][i] *= l[i * S + i];
        store(c[r] + (j + i) * S, x[r][i]);
      }
#pragma GCC unroll 8
      for (int n = i + 1; n < N; ++n)
#pragma GCC unroll 4
        for (int r = 0; r < R; ++r)
          x[r][n] -= x[r][i] * l[i * S + n];
    }
  }

  static void divide_strips(T* panel, Index k, Index s, Index count, Index begin, Index j,
                            Index width) {
    const T* const diagonal = strip(panel, k, j / S);
    T* const first = strip(panel, k, s);
    const std::int64_t next = static_cast<std::int64_t>(S) * k;
    if (count == 3)
      divide_tile<3>({first, first + next, first + 2 * next}, diagonal, begin, j, width);
    else if (count == 2)
      divide_tile<2>({first, first + next}, diagonal, begin, j, width);
    else
      divide_tile<1>({first}, diagonal, begin, j, width);
  }

  static void divide(T* panel, Index k, Run strips, Run columns) {
    for (Index s = strips.begin; s < strips.end; s += 3)
      for (Index j = columns.begin; j < columns.end; j += N)
        divide_strips(panel, k, s, least(3, strips.end - s), columns.begin, j,
                      least(N, columns.end - j));
  }

  /// The strip that holds the diagonal of columns [j, j + width).
  static Index factor_tile(T* own, Index begin, Index j, Index width) {
    V x[1][N];
    product<1, N>(x, {own + begin * S}, own + begin * S + j % S, j - begin);
    for (int i = 0; i < N; ++i)
      x[0][i] = load(own + (j + i) * S) - x[0][i];
    const int shift = static_cast<int>(j % S);
    for (int i = 0; i < width; ++i) {
      V& column = x[0][i];
      const T pivot = column[shift + i];
      if (!(pivot > 0)) return j + i;
      const T reciprocal = 1 / root(pivot);
      column *= reciprocal;
      for (int r = 0; r < shift + i; ++r)
        column[r] = 0;
      for (int n = i + 1; n < width; ++n)
        x[0][n] -= column * column[shift + n];
      column[shift + i] = reciprocal;
      store(own + (j + i) * S, column);
    }
    return -1;
  }
  static float root(float x) { return __builtin_sqrtf(x); }
  static double root(double x) { return __builtin_sqrt(x); }

  static Index factor(T* panel, Index k, Run columns) {
    const Index end = (columns.end + S - 1) / S;
    for (Index j = columns.begin; j < columns.end; j += N) {
      const Index width = least(N, columns.end - j), own = j / S;
      const Index failed = factor_tile(strip(panel, k, own), columns.begin, j, width);
      if (failed >= 0) return failed;
      for (Index s = own + 1; s < end; s += 3)
        divide_strips(panel, k, s, least(3, end - s), columns.begin, j, width);
    }
    return -1;
  }

  /// The lanes of a strip that go to the same strip of another front.
  struct Piece {
    std::uint32_t base; // of that strip
    int last;           // lane of ours
    alignas(Bytes) Lane source[S], mask[S];
  };
  static constexpr int kPieces = 4; ///< above so many it is quicker to go by lanes

  /// Sort `lanes` rows into pieces: how many, or 0 for too many.
  static int pieces(Piece (&piece)[kPieces], const std::uint32_t* row, int lanes) {
    int count = 0;
    for (int lane = 0; lane < lanes; ++lane) {
      const std::uint32_t to = row[lane] % S, base = row[lane] - to;
      if (count == 0 || piece[count - 1].base != base) {
        if (count == kPieces) return 0;
        Piece& fresh = piece[count++];
        fresh.base = base;
        for (int i = 0; i < S; ++i)
          fresh.source[i] = fresh.mask[i] = 0;
      }
      piece[count - 1].source[to] = lane;
      piece[count - 1].mask[to] = -1;
      piece[count - 1].last = lane;
    }
    return count;
  }

  static void scatter_lanes(T* to, const std::uint32_t* row, const std::uint32_t* column,
                            const T* from, Index s, Run columns, int lanes) {
    for (Index j = columns.begin; j < columns.end; ++j)
      for (Index lane = j < s * S ? 0 : j - s * S; lane < lanes; ++lane)
        to[row[lane] + column[j]] += from[j * S + lane];
  }

  static void scatter(T* to, const std::uint32_t* row, const std::uint32_t* column, const T* from,
                      Index s, Run columns, Index lanes) {
    Piece piece[kPieces];
    const int count = kShuffles ? pieces(piece, row, static_cast<int>(lanes)) : 0;
    if (count == 0)
      return scatter_lanes(to, row, column, from, s, columns, static_cast<int>(lanes));
    const Index full = least(columns.end, s * S);
    for (int n = 0; n < count; ++n) {
      const L source = *reinterpret_cast<const L*>(piece[n].source);
      const L mask = *reinterpret_cast<const L*>(piece[n].mask);
      T* const base = to + piece[n].base;
      Index j = columns.begin;
      for (; j < full; ++j) {
        T* const target = base + column[j];
        store(target, load(target) + masked(__builtin_shuffle(load(from + j * S), source), mask));
      }
      // On the diagonal only the lanes from the column's own on.
      const Index end = least(columns.end, s * S + piece[n].last + 1);
      for (; j < end; ++j) {
        T* const target = base + column[j];
        const L below = mask & (source >= static_cast<Lane>(j - s * S));
        store(target, load(target) + masked(__builtin_shuffle(load(from + j * S), source), below));
      }
    }
  }
  static V masked(V value, L mask) {
    return reinterpret_cast<V>(reinterpret_cast<L>(value) & mask);
  }

  static constexpr Kernels<T> table{S,     update,  factor,        divide,
                                    outer, scatter, Base::forward, Base::backward};
};
