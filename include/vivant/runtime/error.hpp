#pragma once
#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace vivant {

/// A failure at run time. The message is one line: what is wrong, where, and what to do. Exit code 1.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The user asked for something that cannot be: an unknown option, key or value. Exit code 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// Throws Error with a formatted message: `fail("[conv2d] weight has {} input channels, x has {}", a, b)`.
template <typename... Args>
[[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) {
  throw Error(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace vivant
