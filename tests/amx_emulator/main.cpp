// AMX for processors that have none: a library to preload. The system turns every unknown instruction into
// SIGILL; this handler computes what a tile instruction would have, on tiles of its own for every thread, and
// goes on behind it. So the tests run the very instructions that the kernels hold, with their operands,
// strides and shapes:
//   LD_PRELOAD=libamx-emulator.so VIVANT_MATRIX_UNITS=emulated op_cases --math bf16x3 conv2d
// After Intel's Software Developer's Manual, volume 2, "Intel AMX instruction set"; sums that are not normal
// are not flushed to zero. Shapes that do not fit, and tiles without a configuration, end the process with a
// line that says why.
#include <dlfcn.h>
#include <signal.h>
#include <ucontext.h>
#include <unistd.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace {

constexpr int most_tiles = 8, most_rows = 16, row_bytes = 64;

struct Tiles {
  bool configured = false;
  int rows[most_tiles], bytes[most_tiles];
  std::uint8_t data[most_tiles][most_rows][row_bytes];
};
thread_local Tiles tiles;

[[noreturn]] void refuse(const char* why) {
  constexpr char begin[] = "AMX emulator: ";
  for (const char* text : {begin, why, "\n"}) (void)!write(STDERR_FILENO, text, std::strlen(text));
  _exit(1);
}

void require(bool condition, const char* why) {
  if (!condition) refuse(why);
}

/// An instruction with a VEX prefix of three bytes, ModRM and perhaps SIB and a displacement.
struct Instruction {
  int map, prefix, vvvv, opcode, mod, reg, rm;
  std::int64_t base = 0, stride = 0;  ///< of a memory operand
  int length = 0;
};

std::int64_t general_register(const ucontext_t& context, int number) {
  constexpr int places[] = {REG_RAX, REG_RCX, REG_RDX, REG_RBX, REG_RSP, REG_RBP, REG_RSI, REG_RDI,
                            REG_R8,  REG_R9,  REG_R10, REG_R11, REG_R12, REG_R13, REG_R14, REG_R15};
  return context.uc_mcontext.gregs[places[number]];
}

std::int64_t displacement(const std::uint8_t* code, int mod) {
  std::int8_t byte = 0;
  std::int32_t word = 0;
  if (mod == 1) std::memcpy(&byte, code, sizeof(byte));
  if (mod == 2) std::memcpy(&word, code, sizeof(word));
  return mod == 1 ? byte : word;
}

void decode_memory(Instruction& in, const std::uint8_t* code, const ucontext_t& context, int index_bit,
                   int base_bit) {
  int base = in.rm;
  if (in.rm == 4) {
    const int sib = code[in.length++], index = (sib >> 3 & 7) | index_bit;
    base = sib & 7;
    if (index != 4) in.stride = general_register(context, index) << (sib >> 6);
  }
  require(in.mod != 0 || base != 5, "an address without a base register");
  in.base = general_register(context, base | base_bit) + displacement(code + in.length, in.mod);
  in.length += in.mod == 1 ? 1 : in.mod == 2 ? 4 : 0;
}

/// False for another instruction, which is not ours.
bool decode(const std::uint8_t* code, const ucontext_t& context, Instruction& in) {
  if (code[0] != 0xC4) return false;
  const int inverted = ~code[1], index_bit = (inverted >> 6 & 1) << 3, base_bit = (inverted >> 5 & 1) << 3;
  in.map = code[1] & 0x1F;
  in.vvvv = ~code[2] >> 3 & 15;
  in.prefix = code[2] & 3;
  if (in.map != 2 || (code[2] & 0x84) != 0) return false;  // W0, 128 bits
  in.opcode = code[3];
  in.mod = code[4] >> 6;
  in.reg = code[4] >> 3 & 7;
  in.rm = code[4] & 7;
  in.length = 5;
  if (in.mod != 3) decode_memory(in, code, context, index_bit, base_bit);
  return true;
}

void configure(const std::uint8_t* shapes) {
  require(shapes[0] == 1 && shapes[1] == 0, "ldtilecfg: the palette must be 1 and the first row 0");
  for (int i = 2; i < 16; ++i) require(shapes[i] == 0, "ldtilecfg: reserved bytes are not zero");
  for (int i = 0; i < 16; ++i) {
    int bytes = shapes[16 + 2 * i] + 256 * shapes[17 + 2 * i], rows = shapes[48 + i];
    require((bytes == 0) == (rows == 0) && bytes <= row_bytes && rows <= most_rows, "ldtilecfg: a shape");
    require(i < most_tiles || rows == 0, "ldtilecfg: more than eight tiles");
    if (i >= most_tiles) continue;
    tiles.bytes[i] = bytes;
    tiles.rows[i] = rows;
  }
  std::memset(tiles.data, 0, sizeof(tiles.data));
  tiles.configured = true;
}

void load(int tile, const Instruction& in) {
  std::memset(tiles.data[tile], 0, sizeof(tiles.data[tile]));
  for (int r = 0; r < tiles.rows[tile]; ++r)
    std::memcpy(tiles.data[tile][r], std::bit_cast<const void*>(in.base + r * in.stride), tiles.bytes[tile]);
}

void store(int tile, const Instruction& in) {
  for (int r = 0; r < tiles.rows[tile]; ++r)
    std::memcpy(std::bit_cast<void*>(in.base + r * in.stride), tiles.data[tile][r], tiles.bytes[tile]);
}

/// A bf16 as a float; one that is not normal counts as zero.
float number(std::uint16_t bits) {
  const std::uint32_t wide = (bits & 0x7F80) == 0 ? (bits & 0x8000u) << 16 : std::uint32_t{bits} << 16;
  float value;
  std::memcpy(&value, &wide, sizeof(value));
  return value;
}

/// c += a . b over pairs of bf16: sums of the first and of the second of every pair, then both.
void multiply(int c, int a, int b) {
  require(b < most_tiles && c != a && c != b && a != b,
          "tdpbf16ps: a tile that does not exist or stands twice");
  require(tiles.rows[c] == tiles.rows[a] && tiles.bytes[c] == tiles.bytes[b] &&
              tiles.bytes[a] / 4 == tiles.rows[b],
          "tdpbf16ps: shapes that do not fit");
  for (int row = 0; row < tiles.rows[c]; ++row) {
    std::uint16_t of_a[row_bytes / 2], of_b[row_bytes / 2];
    float sums[2][row_bytes / 4] = {}, to[row_bytes / 4];
    std::memcpy(of_a, tiles.data[a][row], sizeof(of_a));
    for (int k = 0; k < tiles.rows[b]; ++k) {
      std::memcpy(of_b, tiles.data[b][k], sizeof(of_b));
      for (int part = 0; part < 2; ++part) {
        const float factor = number(of_a[2 * k + part]);
        for (int column = 0; column < tiles.bytes[c] / 4; ++column)
          sums[part][column] += factor * number(of_b[2 * column + part]);
      }
    }
    std::memcpy(to, tiles.data[c][row], sizeof(to));
    for (int column = 0; column < tiles.bytes[c] / 4; ++column)
      to[column] += sums[0][column] + sums[1][column];
    std::memcpy(tiles.data[c][row], to, sizeof(to));
  }
}

bool execute(const Instruction& in) {
  enum Prefix { none, p66, pF3, pF2 };
  const bool memory = in.mod != 3;
  if (in.opcode == 0x49 && in.prefix == none && memory && in.reg == 0) {
    configure(std::bit_cast<const std::uint8_t*>(in.base));
    return true;
  }
  const bool release = in.opcode == 0x49 && in.prefix == none && !memory;
  const bool zero = in.opcode == 0x49 && in.prefix == pF2 && !memory;
  const bool loads = in.opcode == 0x4B && (in.prefix == pF2 || in.prefix == p66) && memory;
  const bool stores = in.opcode == 0x4B && in.prefix == pF3 && memory;
  const bool product = in.opcode == 0x5C && in.prefix == pF3 && !memory;
  if (!release && !zero && !loads && !stores && !product) return false;
  require(release || tiles.configured, "tiles are used before ldtilecfg or after tilerelease");
  if (release) tiles.configured = false;
  if (zero) std::memset(tiles.data[in.reg], 0, sizeof(tiles.data[in.reg]));
  if (loads) load(in.reg, in);
  if (stores) store(in.reg, in);
  if (product) multiply(in.reg, in.rm, in.vvvv);
  return true;
}

void handle(int, siginfo_t*, void* state) {
  auto& context = *static_cast<ucontext_t*>(state);
  auto& place = context.uc_mcontext.gregs[REG_RIP];
  Instruction in{};
  if (!decode(std::bit_cast<const std::uint8_t*>(place), context, in) || !execute(in))
    refuse("an unknown instruction that is none of AMX");
  place += in.length;
}

using SetAction = int (*)(int, const struct sigaction*, struct sigaction*);
SetAction system_sigaction() { return reinterpret_cast<SetAction>(dlsym(RTLD_NEXT, "sigaction")); }

__attribute__((constructor)) void begin() {
  unsetenv("LD_PRELOAD");  // what this process starts needs no emulator
  struct sigaction action {};
  action.sa_sigaction = handle;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  system_sigaction()(SIGILL, &action, nullptr);
}

}  // namespace

/// Compilers set handlers of their own while they work, and kernels run meanwhile: ours stays.
extern "C" __attribute__((visibility("default"))) int sigaction(int number, const struct sigaction* action,
                                                                struct sigaction* before) noexcept {
  return system_sigaction()(number, number == SIGILL ? nullptr : action, before);
}
