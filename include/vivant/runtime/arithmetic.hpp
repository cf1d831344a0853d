#pragma once
#include <string>
#include <string_view>

namespace vivant {

/// How matrix products and convolutions are computed. Sums are in fp32 in every mode.
///   fp32    the portable kernels
///   bf16x3  both factors as sums of two bf16, three products: as exact as fp32 (relative rms error <= 1e-5)
///   bf16    both factors rounded to bf16 (relative rms error <= 1e-2)
enum class Math { fp32, bf16x3, bf16 };

/// What a CPU multiplies bf16 with: the dot products of AVX512-BF16, the tile registers of AMX, or these
/// imitated in plain C, which is slow and for tests.
enum class MatrixUnits { none, dot, amx, imitated };

std::string_view name_of(Math math);
std::string_view name_of(MatrixUnits units);
/// Throws UsageError for a name that is none of fp32, bf16x3, bf16.
Math math_from(const std::string& name);

/// The units that the processor has, that the system lets us use and that are faster than fp32 (dot products:
/// AMD's alone); with the environment's VIVANT_MATRIX_UNITS (none, dot, amx, imitated, or with
/// tests/amx_emulator alone emulated) that one instead, fast or not, or none where it does not exist.
MatrixUnits find_matrix_units();

/// The arithmetic that runs: `wanted` ("": the environment's VIVANT_MATH, else by the units) where these
/// units make it worth while, else fp32. AMX runs every mode; dot products of three bf16 are slower than
/// fp32, so `dot` runs bf16 alone unless VIVANT_MATRIX_UNITS asks for it.
Math choose_math(const std::string& wanted, MatrixUnits units);

}  // namespace vivant
