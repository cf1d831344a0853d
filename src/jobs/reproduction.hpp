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

// Views that are filmed.
constexpr const char* original_views = "original views";
constexpr const char* novel_views = "novel views";
constexpr const char* novel_poses = "novel poses";

/// The stage that measures the films of these views in a style.
std::string film_stage(const std::string& views, const std::string& style);

/// What of a plan the report speaks of.
struct ReproductionPlan {
  std::string capture;
  Config config;
  std::vector<std::string> styles, views;
  bool shell = false;  ///< the camera only rotates
};

/// The rows of all tables.
std::vector<ReproductionRow> reproduction_rows(const ReproductionPlan& plan, const StageResults& results);
/// The tables, with what differs from the paper. Videos are left to the caller.
Report reproduction_report(const ReproductionPlan& plan, const StageResults& results,
                           const std::vector<ReproductionRow>& rows);

}  // namespace vivant
