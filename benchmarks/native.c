/* What the benchmarks measure in C: calls of a kernel, its instructions, and what the machine can.
 *
 * Times of one thread are its own CPU time, which does not count what other processes take.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <ucontext.h>

#include "kernel.h"

#if defined(__AVX512F__)
#define WIDTH 8
#elif defined(__AVX__)
#define WIDTH 4
#else
#define WIDTH 2
#endif
enum { ALIGNMENT = 64, VECTORS = 12 };
typedef double vec __attribute__((vector_size(8 * WIDTH)));

static double seconds(clockid_t clock) {
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void* room(long doubles) {
  size_t bytes = ((size_t)doubles * sizeof(double) + ALIGNMENT) / ALIGNMENT * ALIGNMENT;
  void* start = aligned_alloc(ALIGNMENT, bytes);
  if (start) memset(start, 0, bytes);
  return start;
}

/* The table of a library, NULL if it cannot be opened. */
const supple_library* open_library(const char* path) {
  void* handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  const supple_library* (*table)(void) =
      handle ? (const supple_library* (*)(void))dlsym(handle, "supple_kernels") : NULL;
  return table ? table() : NULL;
}

int lanes(const supple_library* library) { return library->lanes; }

const supple_kernel* find(const supple_library* library, const char* name) {
  for (int k = 0; k < library->kernel_count; ++k)
    if (strcmp(library->kernels[k].name, name) == 0) return &library->kernels[k];
  return NULL;
}

int field_count(const supple_kernel* kernel) { return kernel->field_count; }

const char* field_name(const supple_library* library, const supple_kernel* kernel, int place) {
  return library->fields[kernel->fields[place]].name;
}

static long sizes(const supple_library* library, const supple_kernel* kernel) {
  long all = 0;
  for (int f = 0; f < kernel->field_count; ++f)
    all += library->fields[kernel->fields[f]].size;
  return all * library->lanes;
}

/* Seconds of `rounds` passes over `batches` calls; w and x hold the calls' arrays in turn. */
double time_calls(const supple_library* library, const supple_kernel* kernel, const double* w,
                  const double* x, long batches, long rounds) {
  const long nw = sizes(library, kernel), nx = 3L * library->nodes * library->lanes;
  double* A = room((long)kernel->rows * kernel->cols * library->lanes);
  double *own_w = room(nw * batches), *own_x = room(nx * batches);
  if (!A || !own_w || !own_x) return -1.0;
  memcpy(own_w, w, (size_t)(nw * batches) * sizeof(double));
  memcpy(own_x, x, (size_t)(nx * batches) * sizeof(double));
  const double begin = seconds(CLOCK_THREAD_CPUTIME_ID);
  for (long r = 0; r < rounds; ++r)
    for (long b = 0; b < batches; ++b)
      kernel->call(A, own_w + b * nw, own_x + b * nx);
  const double spent = seconds(CLOCK_THREAD_CPUTIME_ID) - begin;
  free(A), free(own_w), free(own_x);
  return spent;
}

#if defined(__x86_64__)
static uint64_t* traced;
static long trace_count, trace_room;

static void on_step(int signal, siginfo_t* info, void* context) {
  (void)signal, (void)info;
  greg_t* registers = ((ucontext_t*)context)->uc_mcontext.gregs;
  if (trace_count < trace_room)
    traced[trace_count] = (uint64_t)registers[REG_RIP];
  else
    registers[REG_EFL] &= ~0x100LL; /* enough: on at full speed */
  ++trace_count;
}

/* Addresses of the instructions of one call, in their order; how many there were, or `most` + 1 where
 * there are more. The processor's trap flag stops after each. */
long trace(const supple_library* library, const supple_kernel* kernel, const double* w,
           const double* x, uint64_t* addresses, long most) {
  const long nw = sizes(library, kernel), nx = 3L * library->nodes * library->lanes;
  double* A = room((long)kernel->rows * kernel->cols * library->lanes);
  double *own_w = room(nw), *own_x = room(nx);
  memcpy(own_w, w, (size_t)nw * sizeof(double));
  memcpy(own_x, x, (size_t)nx * sizeof(double));
  struct sigaction step = {0}, before;
  step.sa_sigaction = on_step;
  step.sa_flags = SA_SIGINFO;
  traced = addresses, trace_room = most, trace_count = 0;
  kernel->call(A, own_w, own_x); /* resolves what the loader binds at the first call */
  sigaction(SIGTRAP, &step, &before);
  __asm__ volatile("pushfq\n orq $0x100, (%%rsp)\n popfq" ::: "memory", "cc");
  kernel->call(A, own_w, own_x);
  __asm__ volatile("pushfq\n andq $~0x100, (%%rsp)\n popfq" ::: "memory", "cc");
  sigaction(SIGTRAP, &before, NULL);
  free(A), free(own_w), free(own_x);
  return trace_count;
}
#else
long trace(const supple_library* library, const supple_kernel* kernel, const double* w,
           const double* x, uint64_t* addresses, long most) {
  (void)library, (void)kernel, (void)w, (void)x, (void)addresses, (void)most;
  return -1;
}
#endif

/* Flops a second of one core on fused multiply-adds in registers, as wide as the processor's. */
double peak(long rounds) {
  vec sums[VECTORS];
  for (int i = 0; i < VECTORS; ++i)
    sums[i] = (vec){1.0 + i};
  vec scale = (vec){0} + 0.999999, shift = (vec){0} + 1e-6;
  __asm__ volatile("" : "+m"(scale), "+m"(shift));
  const double begin = seconds(CLOCK_THREAD_CPUTIME_ID);
  for (long r = 0; r < rounds; ++r)
    for (int i = 0; i < VECTORS; ++i)
      sums[i] = sums[i] * scale + shift;
  const double spent = seconds(CLOCK_THREAD_CPUTIME_ID) - begin;
  volatile double kept = 0.0;
  for (int i = 0; i < VECTORS; ++i)
    kept += sums[i][0];
  return 2.0 * WIDTH * VECTORS * (double)rounds / spent;
}

/* Bytes a second of a = b + s c on all threads, counted as STREAM does: two reads and a write. */
double triad(long size, int rounds) {
  double *a = room(size), *b = room(size), *c = room(size);
  if (!a || !b || !c) return -1.0;
  double best = 1e30;
  for (int r = 0; r <= rounds; ++r) {
    const double begin = seconds(CLOCK_MONOTONIC);
#pragma omp parallel for simd schedule(static)
    for (long i = 0; i < size; ++i)
      a[i] = b[i] + 3.0 * c[i];
    const double spent = seconds(CLOCK_MONOTONIC) - begin;
    if (r > 0 && spent < best) best = spent;
    b[0] = a[size - 1];
  }
  free(a), free(b), free(c);
  return 24.0 * (double)size / best;
}
