/* The contract between generated kernels and the runtime, in C.
 *
 * A kernel library is one shared object with one exported function, supple_kernels(). Its table
 * says what it holds: nobody needs a generated header, and a library that CMake built looks like
 * one that was compiled at first use. Whoever changes this file changes SUPPLE_KERNEL_ABI here, the
 * writer (kernels/generate.py) and the reader (cpp/src/library.cpp) with it.
 *
 * Lanes: a call treats W cells at once and every array is laid out [entry][lane]; W = 1 is a plain
 * cell. With m nodes a cell, node-major dofs (3a + i), then s scalars (pressures), d = 3m + s:
 *     A  (rows × cols)[W]  the kernel ADDS to it; 1 where absent
 *     w  (sum of field sizes)[W]  the fields that the kernel names, one after another
 *     x  (3m)[W]  coordinates of the mesh's nodes, m
 * All three begin at a multiple of SUPPLE_ALIGNMENT bytes.
 */
#ifndef SUPPLE_KERNEL_H
#define SUPPLE_KERNEL_H

#define SUPPLE_KERNEL_ABI 3
#define SUPPLE_ALIGNMENT 64

#ifdef __cplusplus
extern "C" {
#endif

typedef void (*supple_tabulate)(double* A, const double* w, const double* x);

/* A coefficient: the unknowns "u" have size d, a parameter or a direction its number of entries. */
typedef struct supple_field {
  const char* name;
  int size;
} supple_field;

typedef struct supple_kernel {
  const char* name; /* energy, residual (d), tangent (d × d), volume_ratio, points, d_<field> */
  int rows;         /* of A */
  int cols;
  int lower; /* 1: A is symmetric, and only entries with column <= row are added */
  int field_count;
  const int* fields; /* numbers in supple_library.fields, in the order of w */
  supple_tabulate call;
} supple_kernel;

typedef struct supple_library {
  int abi;             /* SUPPLE_KERNEL_ABI */
  const char* unit;    /* such as neo_hookean.P1.direct */
  const char* hash;    /* of the energy file, if any, and of the generator */
  const char* element; /* P1, P2, Q1, …; of a facet T1, S1, … */
  int nodes;           /* m */
  int scalars;         /* s */
  int lanes;           /* W */
  int degree;          /* of the quadrature */
  int point_count;
  int dimension;         /* of the reference cell */
  const double* points;  /* (point_count, dimension) on the reference cell */
  const double* weights; /* (point_count) */
  int field_count;
  const supple_field* fields;
  int kernel_count;
  const supple_kernel* kernels;
} supple_library;

const supple_library* supple_kernels(void);

#ifdef __cplusplus
}
#endif
#endif
