#include "vivant/runtime/arithmetic.hpp"

#include <cstdlib>

#include "vivant/runtime/error.hpp"

#if defined(__x86_64__) && defined(__linux__)
#include <cpuid.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace vivant {
namespace {

constexpr std::string_view math_names[] = {"fp32", "bf16x3", "bf16"};
constexpr std::string_view unit_names[] = {"none", "dot", "amx", "imitated"};

#if defined(__x86_64__) && defined(__linux__)
struct Registers {
  unsigned a = 0, b = 0, c = 0, d = 0;
};

Registers cpuid(unsigned leaf, unsigned subleaf) {
  Registers r;
  __get_cpuid_count(leaf, subleaf, &r.a, &r.b, &r.c, &r.d);
  return r;
}

/// Which register files the system saves, as bits of XCR0; 0 when it tells nothing.
unsigned saved_registers() {
  constexpr unsigned osxsave = 1u << 27;
  if ((cpuid(1, 0).c & osxsave) == 0) return 0;
  unsigned low = 0, high = 0;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

bool has_dot_products() {
  constexpr unsigned vectors = 0xE6, avx512f = 1u << 16, avx512bw = 1u << 30, avx512_bf16 = 1u << 5;
  const unsigned features = cpuid(7, 0).b;
  return (saved_registers() & vectors) == vectors && (features & avx512f) != 0 &&
         (features & avx512bw) != 0 && (cpuid(7, 1).a & avx512_bf16) != 0;
}

/// Measured: products of bf16 pairs run at twice the rate of fp32 on AMD's processors, at half of it on
/// Intel's.
bool dot_products_are_fast() {
  constexpr unsigned auth = 0x68747541, enti = 0x69746e65, c_amd = 0x444d4163;
  const Registers vendor = cpuid(0, 0);
  return vendor.b == auth && vendor.d == enti && vendor.c == c_amd;
}

/// The processor has tiles, the system saves them, and grants them to this process when it is asked.
bool has_tiles() {
  constexpr unsigned tiles = 3u << 17, amx_bf16 = 1u << 22, amx_tile = 1u << 24;
  const unsigned features = cpuid(7, 0).d;
  if ((features & amx_bf16) == 0 || (features & amx_tile) == 0 || (saved_registers() & tiles) != tiles)
    return false;
  constexpr long request_permission = 0x1023, tile_data = 18;  // ARCH_REQ_XCOMP_PERM
  return syscall(SYS_arch_prctl, request_permission, tile_data) == 0;
}
#else
bool has_dot_products() { return false; }
bool dot_products_are_fast() { return false; }
bool has_tiles() { return false; }
#endif

/// AMX comes with dot products, of which its kernels use the conversion to bf16.
bool exists(MatrixUnits units) {
  switch (units) {
    case MatrixUnits::dot:
      return has_dot_products();
    case MatrixUnits::amx:
      return has_dot_products() && has_tiles();
    default:
      return true;
  }
}

std::string from_environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::string units_of_environment() { return from_environment("VIVANT_MATRIX_UNITS"); }

}  // namespace

std::string_view name_of(Math math) { return math_names[static_cast<int>(math)]; }
std::string_view name_of(MatrixUnits units) { return unit_names[static_cast<int>(units)]; }

Math math_from(const std::string& name) {
  for (const Math math : {Math::fp32, Math::bf16x3, Math::bf16})
    if (name_of(math) == name) return math;
  throw UsageError("unknown arithmetic '" + name + "': it is fp32, bf16x3 or bf16");
}

MatrixUnits find_matrix_units() {
  if (const std::string name = units_of_environment(); !name.empty()) {
    if (name == "emulated")  // tests/amx_emulator does the tiles' instructions
      return has_dot_products() ? MatrixUnits::amx : MatrixUnits::none;
    for (const MatrixUnits units :
         {MatrixUnits::none, MatrixUnits::dot, MatrixUnits::amx, MatrixUnits::imitated})
      if (name_of(units) == name) return exists(units) ? units : MatrixUnits::none;
    throw UsageError("VIVANT_MATRIX_UNITS is '" + name +
                     "': it must be none, dot, amx, imitated or emulated");
  }
  if (exists(MatrixUnits::amx)) return MatrixUnits::amx;
  return exists(MatrixUnits::dot) && dot_products_are_fast() ? MatrixUnits::dot : MatrixUnits::none;
}

Math choose_math(const std::string& wanted, MatrixUnits units) {
  const std::string name = wanted.empty() ? from_environment("VIVANT_MATH") : wanted;
  const Math by_units = units == MatrixUnits::amx ? Math::bf16x3 : Math::fp32;
  const Math math = name.empty() ? by_units : math_from(name);
  const bool slower = units == MatrixUnits::dot && math == Math::bf16x3 && units_of_environment().empty();
  return units == MatrixUnits::none || slower ? Math::fp32 : math;
}

}  // namespace vivant
