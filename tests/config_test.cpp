#include "vivant/jobs/config.hpp"

#include "io_helpers.hpp"
#include "jobs/config_table.hpp"

using namespace vivant;

namespace {

/// The message of the usage error that these settings give.
std::string refusal(const std::string& text, const std::vector<std::string>& settings = {}) {
  try {
    parse_config("", text, "run.toml", settings);
  } catch (const UsageError& error) {
    CHECK_FALSE(contains(error.what(), "\n"));
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("config: flag over file over preset") {
  const Config standard = preset_config("standard"), demo = preset_config("demo");
  CHECK(standard == Config{});
  CHECK(demo.scene.plane_channels != standard.scene.plane_channels);
  CHECK(preset_config("quality").scene.steps > standard.scene.steps);

  const std::string file = "preset = \"demo\"\n[scene]\nplane_size = 96\nunet_rate = 1\n";
  Config config = parse_config("", file, "run.toml", {"scene.unet_rate=2e-3", "human.unet_widths=[16, 32]"});
  CHECK(config.preset == "demo");
  CHECK(config.scene.plane_size == 96);
  CHECK(config.scene.unet_rate == 2e-3);
  CHECK(config.scene.samples == demo.scene.samples);
  CHECK(config.human.unet_widths == std::vector<std::int64_t>{16, 32});
  config = parse_config("quality", file, "run.toml", {"scene.planes=vanilla", "scene.grow_planes=false"});
  CHECK(config.preset == "quality");
  CHECK(config.scene.steps == preset_config("quality").scene.steps);
  CHECK(config.scene.planes == "vanilla");
  CHECK_FALSE(config.scene.grow_planes);
  CHECK(parse_config("", "", "") == standard);
}

TEST_CASE("config: what a run was trained with before a key came stays") {
  const std::string old = "preset = \"demo\"\n[scene]\nplane_size = 96\nplane_scales = 3\n";
  const Config config = parse_run_config(old, "config.toml");
  CHECK(config.scene.coarse_samples == 0);
  CHECK(config.scene.variation_weight == 0);
  CHECK(config.scene.distortion_weight == 0);
  CHECK(config.scene.weight_threshold == 0);
  CHECK(config.scene.cameras == "given");
  CHECK(config.scene.exposure_rate == 0);
  CHECK_FALSE(config.scene.ground);
  CHECK(config.human.mask_softness == 0);
  CHECK(config.human.unseen_views == 0);
  CHECK(config.human.plane_scales == 1);
  CHECK(config.human.variation_weight == 0);
  CHECK(config.human.error_input == "observed");
  CHECK_FALSE(config.human.shading);
  CHECK(config.human.corrections == "learned");
  CHECK(config.human.clothes_band == 0.02);
  CHECK(config.scene.cooldown == 0);
  CHECK(config.human.cooldown == 0);
  CHECK(config.style.feature_weight == 1);
  CHECK(config.style.luma_weight == 8);
  CHECK(parse_run_config("[human]\nfree_band = 0.05\n", "config.toml").human.clothes_band == 0.05);
  CHECK(config.scene.plane_scales == 3);
  CHECK(parse_run_config("[scene]\nplane_size = 96\n", "config.toml").scene.plane_scales == 1);
  const Config today = preset_config("demo");
  CHECK(parse_run_config(to_toml(today), "config.toml") == today);
}

TEST_CASE("config: what is written reads back, for every preset and every key") {
  for (const std::string preset : {"demo", "standard", "quality"}) {
    const Config config = preset_config(preset);
    const std::string text = to_toml(config);
    CHECK(parse_config("", text, "config.toml") == config);
    for (const ConfigSection& section : config_sections())
      for (const ConfigKey& key : section.keys) CHECK(contains(text, key.help));
  }
  // Every key can be set, to each end of its range, and survives.
  for (const ConfigSection& section : config_sections())
    for (const ConfigKey& key : section.keys) {
      CAPTURE(key.name);
      Config config;
      const Setting setting = key.setting(config);
      if (auto* const* integer = std::get_if<std::int64_t*>(&setting)) {
        CHECK(key.lowest <= static_cast<double>(**integer));
        CHECK(static_cast<double>(**integer) <= key.highest);
        const auto highest = static_cast<std::int64_t>(key.highest);
        **integer = highest < 16 ? highest : highest / 16 * 16;
      } else if (auto* const* real = std::get_if<double*>(&setting)) {
        CHECK(key.lowest <= **real);
        CHECK(**real <= key.highest);
        **real += (key.highest - **real) * 1e-3 / 3;
        if (key.name == "scene.near") continue;  // bound by its far end
      } else if (auto* const* flag = std::get_if<bool*>(&setting)) {
        **flag = !**flag;
      } else if (auto* const* choice = std::get_if<std::string*>(&setting)) {
        **choice = key.choices.substr(key.choices.rfind('|') + 1);
      }
      CHECK(parse_config("", to_toml(config), "config.toml") == config);
    }
}

TEST_CASE("config: unknown keys name the nearest known key") {
  CHECK(refusal("[scene]\nplane_sise = 64\n") ==
        "run.toml line 2: unknown key 'scene.plane_sise': did you mean 'scene.plane_size'?");
  CHECK(refusal("seed = 3\n") == "run.toml line 1: unknown key 'seed': did you mean 'training.seed'?");
  CHECK(contains(refusal("[scenes]\nsamples = 64\n"), "did you mean 'scene.samples'?"));
  CHECK(refusal("", {"human.treshold=0.1"}) ==
        "--set: unknown key 'human.treshold': did you mean 'human.threshold'?");
  CHECK(contains(refusal("[scene.plane_size]\nx = 3\n"), "scene.plane_size must be a whole number"));
}

TEST_CASE("config: values of another type or out of range are refused") {
  CHECK(refusal("[scene]\n\nplane_size = 64.5\n") ==
        "run.toml line 3: scene.plane_size must be a whole number from 16 to 2048, not 64.5");
  CHECK(contains(refusal("[scene]\nplane_size = 8\n"), "from 16 to 2048, not 8"));
  CHECK(contains(refusal("[scene]\nplane_size = \"64\"\n"), "must be a whole number"));
  CHECK(contains(refusal("[scene]\nplane_size = 72\n"), "multiple of 16, it is 72"));
  CHECK(contains(refusal("[scene]\nunet_rate = nan\n"), "must be a number from 0 to 1, not nan"));
  CHECK(contains(refusal("[scene]\ngrow_planes = 1\n"), "must be true or false"));
  CHECK(contains(refusal("[scene]\nplanes = \"round\"\n"), "one of: full occupied vanilla"));
  CHECK(contains(refusal("[scene]\nplanes = \"full|occupied\"\n"), "one of"));
  CHECK(contains(refusal("[scene]\nunet_widths = []\n"), "list of whole numbers"));
  CHECK(contains(refusal("[scene]\nunet_widths = [32, \"x\"]\n"), "list of whole numbers"));
  CHECK(contains(refusal("[scene]\nnear = 30\nfar = 20\n"), "scene.near must be smaller"));
  CHECK(contains(error_of([] { load_config("demo", {}, {"human.box_margin=0.05"}); }),
                 "human.box_margin must not be smaller"));
  CHECK(parse_run_config("[human]\nbox_margin = 0.1\nthreshold = 0.12\n", "config.toml").human.threshold ==
        0.12);
  CHECK(contains(refusal("[scene\n"), "run.toml line 1: broken TOML"));
  CHECK(contains(refusal("preset = \"best\"\n"), "no preset 'best': use demo, standard, quality"));
  CHECK(contains(refusal("preset = 3\n"), "preset must be"));
  CHECK(contains(refusal("", {"scene.samples"}), "takes key=value"));
  CHECK(contains(refusal("", {"scene.samples="}), "must be a whole number"));
  CHECK(contains(refusal("", {"scene.samples=many"}), "not 'many'"));
  CHECK(contains(refusal("", {"scene.samples=3\n[x]\ny=1"}), "must be a whole number"));
  const TemporaryFolder folder;
  CHECK(contains(error_of([&] { load_config("", folder / "none.toml", {}); }), "does not exist"));
}
