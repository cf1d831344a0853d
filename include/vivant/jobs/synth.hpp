#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>

namespace vivant {

struct SynthOptions {
  std::filesystem::path output;  ///< a new or empty folder
  int frames = 40;
  int width = 320;
  int height = 240;
  std::uint32_t seed = 0;        ///< changes the colours, the textures and the walk's phase
  std::filesystem::path motion;  ///< poses, BVH or AMASS file; empty: a procedural walk
};

/// Called after each picture: how many are done, how many there will be.
using SynthProgress = std::function<void(int done, int total)>;

/// Makes a capture whose truth is known exactly: a clothed person who walks through a furnished room, seen by
/// a camera that moves around. `output` becomes a capture (docs/capture-format.md) with images, masks, poses,
/// body and surface points, and output/dance.safetensors is a motion to animate it with. For evaluation
/// alone, output/truth/novel_views (the same instants from other places) and output/truth/novel_poses (poses
/// that the capture does not hold) are captures too; their splits hold nothing out, use every frame. Metres,
/// y up, floor at y = 0. The same options give the same bytes. Throws UsageError for sizes or counts that
/// make no sense, Error when a file cannot be written or the motion leaves the room.
void synthesise(const SynthOptions& options, const SynthProgress& progress = {});

}  // namespace vivant
