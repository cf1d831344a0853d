#include <doctest/doctest.h>

#include <set>

#include "child_process.hpp"
#include "tiny_training.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/json.hpp"

using namespace vivant;
namespace fs = std::filesystem;

namespace {

/// `vivant reproduce` of the tiny capture into `folder`, all stages with a step or two.
std::vector<std::string> tiny_reproduction(const fs::path& folder, const std::string& style = "mosaic") {
  // The motion is as short as the capture: quick.
  std::vector<std::string> arguments = {"reproduce", tiny_capture().string(),
                                        "-o",        folder.string(),
                                        "--motion",  (tiny_capture() / "poses.safetensors").string(),
                                        "--style",   asset_path("styles/" + style + ".jpg").string()};
  const std::vector<std::string> settings = tiny_settings(2, 1);
  arguments.insert(arguments.end(), settings.begin(), settings.end());
  for (const char* setting :
       {"scene.plane_size=16", "human.render_step=0.03", "features.steps=1", "features.views=1",
        "features.patch=32", "style.steps=1", "style.crop=64", "style.novel_views=0"})
    arguments.insert(arguments.end(), {"--set", setting});
  return arguments;
}

Finished run_tiny(const std::vector<std::string>& arguments) {
  std::string line;
  for (const std::string& argument : arguments) line += " '" + argument + "'";
  return run_vivant(line);
}

/// When each file below was written last, but for locks.
std::map<std::string, fs::file_time_type> written(const fs::path& folder) {
  std::map<std::string, fs::file_time_type> times;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && !entry.path().filename().string().starts_with("report"))
      times[entry.path().string()] = entry.last_write_time();
  return times;
}

void check_rows(const nlohmann::json& rows) {
  std::set<std::string> tables;
  int measured = 0, beside = 0;
  for (const nlohmann::json& row : rows) {
    CHECK(row.size() == 6);
    CHECK(row.at("capture") == "walk");
    CAPTURE(row.dump());
    tables.insert(row.at("table"));
    const std::string method = row.at("method");
    const bool run_here =
        !std::set<std::string>{"LST", "CCPL", "StyleRF", "IEContraAST", "CSBNet"}.contains(method);
    // Seven frames apart the tiny pictures have too little in common.
    const bool far = contains(row.at("metric"), "gap 7") || contains(row.at("metric"), "gaps");
    if (run_here && !far) CHECK(row.at("value").is_number());
    if (!run_here) CHECK((row.at("value").is_null() && row.at("paper").is_number()));
    measured += run_here;
    beside += run_here && row.at("paper").is_number();
  }
  CHECK(tables == std::set<std::string>{"original views", "novel views and poses", "novel views",
                                        "novel poses", "2D methods on our rendered frames",
                                        "vanilla tri-plane", "run time", "held-out frames"});
  CHECK(beside == 9);  // two methods in each of four tables, and the time saved
  CHECK(measured > 100);
}

double value_of(const nlohmann::json& rows, const std::string& table, const std::string& method,
                const std::string& metric, const std::string& capture = "walk") {
  for (const nlohmann::json& row : rows)
    if (row.at("table") == table && row.at("method") == method && row.at("metric") == metric &&
        row.at("capture") == capture)
      return row.at("value");
  FAIL("no row " << table << ", " << method << ", " << metric);
  return 0;
}

/// A second capture of which all is done, so that its report is joined with the first one's at once: the
/// first capture's, whose planes took 30 ms longer.
void check_joined(const fs::path& made, const fs::path& folder) {
  const fs::path second = folder / "stroll", output = folder / "both";
  fs::copy(tiny_capture(), second, fs::copy_options::recursive);
  for (const char* name : {"walk", "stroll"}) {
    fs::create_directories(output / name);
    fs::copy(made / "results", output / name / "results");
    fs::copy(made / "plan.json", output / name / "plan.json");
  }
  nlohmann::json plan = read_json(output / "stroll/plan.json"),
                 time = read_json(output / "stroll/results/run-time.json");
  plan["capture"] = fs::canonical(second).string();
  time["planes_ms"] = time["planes_ms"].get<double>() + 30;
  write_text_file(output / "stroll/plan.json", plan.dump());
  write_text_file(output / "stroll/results/run-time.json", time.dump());

  std::vector<std::string> arguments = tiny_reproduction(output);
  arguments.push_back(second.string());
  const Finished both = run_tiny(arguments);
  REQUIRE_MESSAGE(both.exit_code == 0, both.err);
  const nlohmann::json rows = read_json(output / "report.json").at("rows");
  const std::string near = "ST-LPIPS gap 1", metric = "ms for 4096 rays x 16 samples";
  CHECK(value_of(rows, "novel views", "vivant", near, "mean") ==
        doctest::Approx(value_of(rows, "novel views", "vivant", near, "stroll")));
  CHECK(value_of(rows, "run time", "tri-plane", metric, "mean") ==
        doctest::Approx(value_of(rows, "run time", "tri-plane", metric) + 15));
  const std::string text = read_whole_file(output / "report.md");
  for (const char* part : {"## mean: original views", "## walk: run time", "## stroll: run time",
                           "walk: The paper's tables on one capture", "stroll: The paper's tables on one"}) {
    CAPTURE(std::string(part));
    CHECK(contains(text, part));
  }
  const std::size_t common = text.find("What differs from the paper");
  CHECK(text.find("stroll: The paper's tables") < common);
  CHECK(text.find("What differs from the paper", common + 1) == std::string::npos);
  const Finished twice =
      run_vivant("reproduce " + second.string() + " " + (second / "transforms.json").string());
  CHECK(twice.exit_code == 2);
  CHECK(twice.err == "vivant: two captures are called 'stroll': rename one\n");
}

}  // namespace

TEST_CASE("reproduce: stopped, resumed, and every table of the paper") {
  const TemporaryFolder folder;
  const fs::path output = folder / "report", first = output / "results/train-vivant.json";
  {  // stopped after the first stage
    BackgroundVivant job(tiny_reproduction(output), folder / "log");
    while (job.runs() && !fs::exists(first)) usleep(10000);
    CHECK(job.finish(SIGINT) == 130);
    CHECK(contains(read_whole_file(folder / "log"), "the same command goes on from here"));
    CHECK(!fs::exists(output / "report.json"));
  }
  REQUIRE(fs::exists(first));
  const auto trained = fs::last_write_time(first);
  std::vector<std::string> arguments = tiny_reproduction(output);
  arguments.insert(arguments.end(), {"--json", (folder / "figures.json").string()});
  const Finished made = run_tiny(arguments);
  REQUIRE_MESSAGE(made.exit_code == 0, made.err);
  CHECK(fs::last_write_time(first) == trained);
  CHECK(!contains(made.err, ": train vivant\n"));
  CHECK(contains(made.err, ": train vanilla tri-plane\n"));

  const nlohmann::json rows = read_json(output / "report.json").at("rows");
  CHECK(read_json(folder / "figures.json").at("rows") == rows);
  check_rows(rows);
  // The mean of both gaps, of both kinds of novel views; and what each table shows.
  const std::string both = "ST-LPIPS, mean of gaps 1 and 7";
  const auto novel = [&](const std::string& table, const std::string& metric) {
    return value_of(rows, table, "vivant", metric);
  };
  CHECK(
      novel("novel views", both) ==
      doctest::Approx((novel("novel views", "ST-LPIPS gap 1") + novel("novel views", "ST-LPIPS gap 7")) / 2));
  CHECK(novel("novel views and poses", both) ==
        doctest::Approx((novel("novel views", both) + novel("novel poses", both)) / 2));
  const std::string near = "ST-LPIPS gap 1";
  CHECK(value_of(rows, "original views", "AdaAttN on captured frames", near) !=
        value_of(rows, "2D methods on our rendered frames", "AdaAttN on rendered frames", near));
  CHECK(novel("vanilla tri-plane", near) != value_of(rows, "vanilla tri-plane", "vanilla tri-plane", near));
  CHECK(novel("vanilla tri-plane", near) == novel("original views", near));
  CHECK(value_of(rows, "novel poses", "vanilla tri-plane", near) != novel("novel poses", near));
  CHECK(novel("novel views", "content distance") > 0);
  CHECK(value_of(rows, "held-out frames", "vivant", "background's PSNR, dB") > 0);
  CHECK(contains(read_whole_file(output / "runs/vivant/config.toml"), "\nplanes = \"full\""));
  CHECK(contains(read_whole_file(output / "runs/vanilla-tri-plane/config.toml"), "\nplanes = \"vanilla\""));

  // AdaAttN is its own network, not the stylizer of films.
  const fs::path films = output / "films";
  const Finished painted = run_tiny({"stylise", (films / "original-views-rendered").string(), "--style",
                                     asset_path("styles/mosaic.jpg").string(), "--form", "cosine", "-o",
                                     (folder / "AdaAttN").string()});
  REQUIRE_MESSAGE(painted.exit_code == 0, painted.err);
  CHECK(read_whole_file(folder / "AdaAttN/0000.png") ==
        read_whole_file(films / "original-views-mosaic-AdaAttN-on-rendered-frames/0000.png"));

  const std::string text = read_whole_file(output / "report.md"),
                    page = read_whole_file(output / "report.html");
  for (const char* part :
       {"## original views", "| CCPL |", "paper: LPIPS", "not LPIPS", "NeuMan", "scene.steps = 2",
        "DIS on the capture", "what `vivant train` makes", "Held-out frames: "}) {
    CAPTURE(std::string(part));
    CHECK(contains(text, part));
  }
  CHECK(contains(page, "<video"));
  CHECK(contains(page, "novel views, mosaic: consistency, gap 1"));

  // Once more: nothing is made anew.
  const auto before = written(output);
  const Finished again = run_tiny(tiny_reproduction(output));
  CHECK(again.exit_code == 0);
  CHECK(again.out == made.out);
  CHECK(written(output) == before);
  CHECK(read_json(output / "report.json").at("rows") == rows);
  check_joined(output, folder.path());
  // Films by other weights than this program's are not mixed with these.
  const std::string plan = read_whole_file(output / "plan.json");
  nlohmann::json older = read_json(output / "plan.json");
  CHECK(contains(older.at("weights").at(0).get<std::string>(), "adaattn.safetensors "));
  CHECK(contains(older.at("weights").at(1).get<std::string>(), "stylizer.safetensors "));
  older["weights"][1] = "stylizer.safetensors 00000000";
  write_text_file(output / "plan.json", older.dump());
  CHECK(contains(run_tiny(tiny_reproduction(output)).err, "with other weights"));
  older.erase("weights");
  write_text_file(output / "plan.json", older.dump());
  CHECK(contains(run_tiny(tiny_reproduction(output)).err, "with other weights"));
  write_text_file(output / "plan.json", plan);
  // Another painting belongs elsewhere.
  const Finished other = run_tiny(tiny_reproduction(output, "cubist"));
  CHECK(other.exit_code == 1);
  CHECK(contains(other.err, "(styles differ)"));
  std::vector<std::string> longer = tiny_reproduction(output);
  longer.insert(longer.end(), {"--set", "scene.steps=3"});
  CHECK(contains(run_tiny(longer).err, "(settings differ)"));
}
