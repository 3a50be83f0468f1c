// Chooses the width of the registers in which kernels run.
//
// Each kernel is written once and compiled in several forms: for the processor's baseline, on x86-64 also for
// AVX2, and for AVX-512 if this form is faster. When the program starts, it chooses the widest form that the
// processor supports. All forms do the same operations in the same order and differ only in the width of
// registers, so they give the same bits.
#pragma once

#define FREEFLEX_KERNEL inline __attribute__((always_inline))

namespace freeflex {

enum class Width { kBaseline, kAvx2, kAvx512 };

// A test that compares the bits of the forms defines this macro to limit the kernels to a narrower form: 0
// baseline, 1 AVX2, 2 AVX-512.
#ifndef FREEFLEX_WIDEST
#define FREEFLEX_WIDEST 2
#endif

#if defined(__x86_64__)
inline Width find_width() noexcept {
  __builtin_cpu_init();
  if (FREEFLEX_WIDEST >= 2 && __builtin_cpu_supports("avx512f")) return Width::kAvx512;
  return FREEFLEX_WIDEST >= 1 && __builtin_cpu_supports("avx2") ? Width::kAvx2 : Width::kBaseline;
}
inline const Width kWidth = find_width();

template <auto kernel, class... Args>
__attribute__((target("avx2"))) void run_avx2(Args... args) noexcept {
  kernel(args...);
}
template <auto kernel, class... Args>
__attribute__((target("avx2,avx512f"))) void run_avx512(Args... args) noexcept {
  kernel(args...);
}
#endif

/// Runs the AVX2 form of a kernel if the processor has AVX2, otherwise the baseline form.
template <auto kernel, class... Args>
void run(Args... args) noexcept {
#if defined(__x86_64__)
  if (kWidth != Width::kBaseline) {
    run_avx2<kernel>(args...);
    return;
  }
#endif
  kernel(args...);
}

/// Runs the widest form of a kernel that consists of plain loops.
template <auto kernel, class... Args>
void run_auto(Args... args) noexcept {
#if defined(__x86_64__)
  if (kWidth == Width::kAvx512) {
    run_avx512<kernel>(args...);
    return;
  }
#endif
  run<kernel>(args...);
}

/// Runs the widest form of a kernel that the processor supports.
template <auto baseline, auto avx2, auto avx512, class... Args>
void run_widest(Args... args) noexcept {
#if defined(__x86_64__)
  if (kWidth == Width::kAvx512) {
    run_avx512<avx512>(args...);
    return;
  }
  if (kWidth == Width::kAvx2) {
    run_avx2<avx2>(args...);
    return;
  }
#endif
  baseline(args...);
}

}  // namespace freeflex
