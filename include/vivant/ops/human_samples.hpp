#pragma once
#include "vivant/ops/closest_point.hpp"

namespace vivant {

/// Words of one sample's record: canonical point (3 floats), canonical direction (octahedral, 2 x 16 bits),
/// triangle, barycentric weights of its second and third corner (2 x 16 bits), signed distance (float), index
/// of its step, observed normal (octahedral).
constexpr std::int64_t sample_record_words = 9;

/// The depth of the places of a ray that hold no sample.
constexpr double no_sample_depth = 1e4;

struct TraceOptions {
  double step = 0.0075;                ///< metres between samples; sample k lies at depth (k + 1/2) step
  double threshold = 0.08;             ///< metres: samples farther from the body are left out
  std::int64_t samples_per_ray = 192;  ///< the most; those behind are dropped
  std::int64_t capacity = 0;           ///< of all samples; 0: rays x samples per ray, which never overflows
};

/// The samples of many rays near a posed body, compact, in the order of the rays and of depth.
struct TracedSamples {
  Value records;   ///< i32 [capacity, 9], with a count of live rows
  Value offsets;   ///< i32 [R + 1, 1]: ray r has the records [offsets[r], offsets[r + 1])
  Value overflow;  ///< i32 [1]: 1 when samples did not fit into the capacity
};

/// Marches along rays (origins, directions [R, 3], unit length; R may carry a count) and keeps the samples
/// whose distance to the body is below the threshold, warped to the canonical pose by `transforms` [V, 12]
/// (canonical -> observation; see inverse_warp). Distances change by at most the way walked, so that far
/// samples are skipped without loss. No gradient.
TracedSamples trace_samples(Value origins, Value directions, const PosedMesh& mesh, Value transforms,
                            const TraceOptions& options);

/// Rays as the posed root joint sees them: origins and directions [R, 3] -> [R, 6], turned and shifted into
/// the root's frame. transforms [J, 12] (rest -> posed) have the root first; `root` is its rest position,
/// metres. No gradient.
Value root_rays(Value origins, Value directions, Value transforms, const Eigen::Vector3d& root);

/// Traced samples of rays of one frame or many.
struct SampleTable {
  Value records;  ///< i32 [M, 9]
  Value offsets;  ///< i32 [R + 1, 1]
  Value frames;   ///< i32 [R, 1] frame of each ray; absent: 0
  Value roots;  ///< [R, 6] origin and direction of each ray in the frame of the posed root joint; absent: no
                ///< root
};

/// The samples of some rays. What has N rows has a device-side count of live ones; N is the capacity.
struct HumanSamples {
  Value points;      ///< [N, 3] canonical, metres
  Value directions;  ///< [N, 3] canonical, unit length
  Value normals;     ///< [N, 3] of the posed body at the closest point, smooth over its edges, unit length
  Value root;        ///< [N, 3] observed point in the frame of the posed root joint; absent without roots
  Value signed_distance;  ///< [N, 1] metres to the posed body
  Value face;             ///< i32 [N, 1] triangle of the closest point
  Value barycentric;      ///< [N, 3] of the closest point
  Value frame;            ///< i32 [N, 1]
  Value ids;  ///< i32 [N] place r * S + s of the row among the B x S of the dense tensors, ascending
  Value depths, deltas;  ///< [B, S] ascending; places without a sample have no_sample_depth and 0
  Value rows;            ///< i32 [B, S] the row of each place, -1 where there is no sample
  Value overflow;        ///< i32 [1]: 1 when the rows did not fit into the capacity
};

/// Copies the samples of `rays` i32 [B] (indices into the table) into rows; of each ray at most S =
/// `samples_per_ray`, the front ones. `jitter` [B, 1] in [0, 1), or absent, moves all samples of a ray by
/// (jitter - 1/2) steps along it: depth, canonical point and root. `capacity` 0 stands for B * S. No
/// gradient.
HumanSamples gather_samples(const SampleTable& table, Value rays, Value jitter, double step,
                            std::int64_t samples_per_ray, std::int64_t capacity = 0);

}  // namespace vivant
