#include <cpuid.h>
#include <immintrin.h>
#include <cstddef>
#include <new>
#define __cpuidex moc_cpuidex
#define _xgetbv moc_xgetbv
