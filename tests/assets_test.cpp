#include "vivant/io/assets.hpp"

#include <doctest/doctest.h>

#include <cstdlib>

#include "vivant/runtime/error.hpp"

using namespace vivant;

TEST_CASE("assets are found in the source tree, and only in VIVANT_ASSETS when it is set") {
  CHECK(std::filesystem::exists(asset_path("body.safetensors")));
  CHECK_THROWS_WITH_AS(asset_path("no_such_asset"), doctest::Contains("no_such_asset"), Error);

  setenv("VIVANT_ASSETS", "/no/such/folder", 1);
  CHECK_THROWS_WITH_AS(asset_path("body.safetensors"), doctest::Contains("/no/such/folder"), Error);
  unsetenv("VIVANT_ASSETS");
}
