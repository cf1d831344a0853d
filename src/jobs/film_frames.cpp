#include "vivant/jobs/film_frames.hpp"

namespace vivant {
namespace {

cv::Mat copied(const std::vector<float>& values, const LayerFrame& frame) {
  return values.empty() ? cv::Mat() : cv::Mat(values, true).reshape(1, frame.height);
}

/// A picture [H, W, 3] that shares the values.
cv::Mat colours_of(const std::vector<float>& rgb, const LayerFrame& frame) {
  return {frame.height, frame.width, CV_32FC3, const_cast<float*>(rgb.data())};
}

/// Puts a layer back into a mean as it was before: of the person, or of the scene.
void put_back(const cv::Mat& before, const cv::Mat& person, bool of_person, cv::Mat& mean) {
  for (int y = 0; y < mean.rows; ++y)
    for (int x = 0; x < mean.cols; ++x) {
      const float share = of_person ? person.at<float>(y, x) : 1 - person.at<float>(y, x);
      cv::Vec3f& colour = mean.at<cv::Vec3f>(y, x);
      colour = share * before.at<cv::Vec3f>(y, x) + (1 - share) * colour;
    }
}

const Body* body_of(const OpenRun& run) {
  return run.model->human() ? &run.model->human()->body().body() : nullptr;
}

}  // namespace

struct FilmFrames::Entry {
  LayerFrame frame;
  SurfaceView surface;
  std::map<std::size_t, std::vector<float>> painted;  ///< by look
};

FilmFrames::FilmFrames(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
                       const std::string& layers, const std::vector<Look>& looks)
    : film_(film),
      body_(body_of(run)),
      looks_(looks),
      renderer_(device, run, scene, film, layers, !looks.empty()),
      surface_flow_(body_, film.units_per_metre) {
  if (!looks.empty()) stylizer_.emplace(device, scene, film, renderer_, looks);
}
FilmFrames::~FilmFrames() = default;

FilmFrames::Entry& FilmFrames::entry(int shot) {
  if (const auto found = entries_.find(shot); found != entries_.end()) return found->second;
  const Shot& plan = film_.shot(shot);
  Entry made{renderer_.render(plan), {}, {}};
  const std::vector<float>& person = made.frame.alpha.empty() ? made.frame.person : made.frame.alpha;
  made.surface = {plan.camera, copied(made.frame.depth, made.frame), copied(person, made.frame)};
  if (body_ && plan.person)
    made.surface.joints = joint_transforms(*body_, plan.person->pose, plan.person->translation);
  return entries_.emplace(shot, std::move(made)).first->second;
}

void FilmFrames::forget_all_but(int first, int last) {
  const auto gone = [&](int shot) { return shot < first || shot > last; };
  std::erase_if(entries_, [&](const auto& one) { return gone(one.first); });
  std::erase_if(flows_, [&](const auto& one) { return gone(one.first.first) || gone(one.first.second); });
}

const LayerFrame& FilmFrames::rendered(int shot) {
  forget_all_but(shot - Film::reach, shot + Film::reach);
  return entry(shot).frame;
}

const SurfaceView& FilmFrames::surface(int shot) { return entry(shot).surface; }

const std::vector<float>& FilmFrames::painted(int shot, std::size_t look) {
  Entry& here = entry(shot);
  if (const auto found = here.painted.find(look); found != here.painted.end()) return found->second;
  const std::vector<float>& painted =
      here.painted.emplace(look, stylizer_->paint(here.frame, look)).first->second;
  if (here.painted.size() == looks_.size()) here.frame.features = {};  // by far the largest part of a frame
  return painted;
}

const FilmFrames::Flows& FilmFrames::flows(int from, int to) {
  Flows& found = flows_[{from, to}];
  if (found.dis.empty())
    found = {surface_flow_.flow(surface(from), surface(to)),
             dis_flow(to_picture(entry(from).frame), to_picture(entry(to).frame))};
  return found;
}

std::vector<Neighbour> FilmFrames::neighbours(int shot, std::size_t look) {
  const LayerFrame& frame = entry(shot).frame;
  const cv::Mat here = colours_of(frame.rgb, frame);
  std::vector<Neighbour> result;
  for (int other = shot - Film::reach; other <= shot + Film::reach; ++other) {
    if (other == shot || !film_.has_shot(other)) continue;
    const LayerFrame& next = entry(other).frame;
    if (next.width != frame.width || next.height != frame.height) continue;
    const cv::Mat there = colours_of(next.rgb, next);
    const Flows &forward = flows(shot, other), &backward = flows(other, shot);
    const Correspondence found =
        best_flow(here, there, {{forward.geometry, backward.geometry}, {forward.dis, backward.dis}});
    result.push_back({colours_of(painted(other, look), next), found.flow,
                      trust_in(here, there, surface(shot).person, found)});
  }
  return result;
}

LayerFrame FilmFrames::stylised(int shot, std::size_t look) {
  forget_all_but(shot - Film::reach, shot + Film::reach);
  const LayerFrame& plain = entry(shot).frame;
  const cv::Mat alone = colours_of(painted(shot, look), plain), person = surface(shot).person;
  cv::Mat mean =
      looks_[look].strength > 0 ? with_detail_of(alone, temporal_mean(alone, neighbours(shot, look))) : alone;
  if (looks_[look].layered() && !person.empty())
    for (const bool of_person : {true, false})
      if ((of_person ? looks_[look].person : looks_[look].scene).empty())
        put_back(alone, person, of_person, mean);
  LayerFrame result{plain.width, plain.height, {}, plain.alpha, plain.person, plain.depth, {}};
  result.rgb.assign(mean.ptr<float>(), mean.ptr<float>() + 3 * mean.total());
  for (std::size_t i = 0; i < result.alpha.size(); ++i)
    for (int c = 0; c < 3; ++c) result.rgb[3 * i + c] *= result.alpha[i];
  return result;
}

}  // namespace vivant
