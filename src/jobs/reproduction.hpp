// What `reproduce` makes and what its report is made of.
#pragma once
#include <functional>
#include <map>

#include "vivant/jobs/reproduce.hpp"

namespace vivant {

/// The results of the stages, by their names, as they lie in results/.
using StageResults = std::map<std::string, nlohmann::ordered_json>;

// Methods, as films and tables call them.
constexpr const char* method_ours = "vivant";
constexpr const char* method_unaveraged = "vivant-unaveraged";
constexpr const char* method_captured = "AdaAttN on captured frames";
constexpr const char* method_rendered = "AdaAttN on rendered frames";
constexpr const char* method_rendered_averaged = "AdaAttN on rendered frames-averaged";
constexpr const char* method_vanilla = "vanilla tri-plane";

// What tables and notes both speak of.
constexpr const char* both_gaps = "ST-LPIPS, mean of gaps 1 and 7";  // what the paper's LPIPS is the mean of
constexpr const char* vanilla_table = "vanilla tri-plane";
constexpr const char* held_out_table = "held-out frames";
constexpr const char* held_out_psnr = "PSNR, dB";

// Views that are filmed.
constexpr const char* original_views = "original views";
constexpr const char* novel_views = "novel views";
constexpr const char* novel_poses = "novel poses";

/// The stage that measures the films of these views in a style.
std::string film_stage(const std::string& views, const std::string& style);

/// What of a capture's plan the report speaks of.
struct ReproductionPlan {
  std::string capture;
  Config config;
  std::vector<std::string> styles, views;
  bool shell = false;  ///< the camera only rotates
};

/// The rows of all tables.
std::vector<ReproductionRow> reproduction_rows(const ReproductionPlan& plan, const StageResults& results);
/// The means over captures of the figures that all of them have, as rows of the capture "mean".
std::vector<ReproductionRow> mean_rows(const std::vector<ReproductionRow>& rows, std::size_t captures);
/// What must be known to read the figures beside the paper's: a paragraph each.
std::vector<std::string> reproduction_notes(const ReproductionPlan& plan, const StageResults& results,
                                            const std::vector<ReproductionRow>& rows);
/// A table for each of the rows', in their order; every title begins with `prefix`.
std::vector<Report::Table> reproduction_tables(const std::vector<ReproductionRow>& rows,
                                               const std::string& prefix = "");
/// The consistency of the films of the first style, frame by frame.
std::vector<Report::Plot> reproduction_plots(const ReproductionPlan& plan, const StageResults& results);

/// The means over the captures, then the tables of each.
Reproduction joined(const std::vector<Reproduction>& all, const std::filesystem::path& folder);
/// report.json, report.md and report.html in its folder.
void write_reproduction(const Reproduction& made);

}  // namespace vivant
