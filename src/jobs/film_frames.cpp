#include "vivant/jobs/film_frames.hpp"

#include "vivant/io/image.hpp"

namespace vivant {
namespace {

cv::Mat copied(const std::vector<float>& values, const LayerFrame& frame) {
  return values.empty() ? cv::Mat() : cv::Mat(values, true).reshape(1, frame.height);
}

/// A picture [H, W, 3] that shares the values.
cv::Mat colours_of(const std::vector<float>& rgb, const LayerFrame& frame) {
  return {frame.height, frame.width, CV_32FC3, const_cast<float*>(rgb.data())};
}

const Body* body_of(const OpenRun& run) {
  return run.model->human() ? &run.model->human()->body().body() : nullptr;
}

}  // namespace

struct FilmFrames::Entry {
  LayerFrame frame;
  SurfaceView surface;
  std::map<std::pair<std::size_t, Layer>, std::vector<float>> painted;  ///< by look and layer
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
  const auto of_gone = [&](const auto& one) { return gone(one.first.first) || gone(one.first.second); };
  std::erase_if(matches_, of_gone);
}

const LayerFrame& FilmFrames::rendered(int shot) {
  forget_all_but(shot - Film::reach, shot + Film::reach);
  return entry(shot).frame;
}

const SurfaceView& FilmFrames::surface(int shot) { return entry(shot).surface; }

const std::vector<float>& FilmFrames::painted(int shot, std::size_t look, Layer layer) {
  Entry& here = entry(shot);
  const std::pair key(look, layer);
  if (const auto found = here.painted.find(key); found != here.painted.end()) return found->second;
  const std::vector<float>& painted =
      here.painted.emplace(key, stylizer_->paint(here.frame, look, layer)).first->second;
  std::size_t wanted = 0;
  for (const Look& one : looks_) wanted += layers_to_paint(here.frame, one).size();
  if (here.painted.size() == wanted) here.frame.features = {};  // by far the largest part of a frame
  return painted;
}

FilmFrames::Flows FilmFrames::flows(int from, int to) {
  return {surface_flow_.flow(surface(from), surface(to)),
          dis_flow(to_picture(entry(from).frame), to_picture(entry(to).frame))};
}

FilmFrames::Match FilmFrames::matched(int from, int to, const Flows& forward, const Flows& backward) {
  const LayerFrame &first = entry(from).frame, &second = entry(to).frame;
  const cv::Mat here = colours_of(first.rgb, first), there = colours_of(second.rgb, second);
  const Correspondence found =
      best_flow(here, there, {{forward.geometry, backward.geometry}, {forward.dis, backward.dis}});
  return {found.flow, trust_in(here, there, surface(from).person, found)};
}

const FilmFrames::Match& FilmFrames::match(int from, int to) {
  if (const auto known = matches_.find({from, to}); known != matches_.end()) return known->second;
  // Both ways at once: flows are too large to be kept.
  const Flows forward = flows(from, to), backward = flows(to, from);
  matches_[{to, from}] = matched(to, from, backward, forward);
  return matches_[{from, to}] = matched(from, to, forward, backward);
}

cv::Mat FilmFrames::mean(int shot, const PictureOfShot& picture) {
  const LayerFrame& frame = entry(shot).frame;
  const cv::Mat alone = picture(shot);
  std::vector<Neighbour> neighbours;
  for (int other = shot - Film::reach; other <= shot + Film::reach; ++other) {
    if (other == shot || !film_.has_shot(other)) continue;
    const LayerFrame& next = entry(other).frame;
    if (next.width != frame.width || next.height != frame.height) continue;
    const cv::Mat colours = picture(other);
    if (colours.empty()) continue;
    const Match& found = match(shot, other);
    neighbours.push_back({colours, found.flow, found.trust});
  }
  return with_detail_of(alone, temporal_mean(alone, neighbours));
}

cv::Mat FilmFrames::with_brushwork(int shot, std::size_t look, Layer layer, const cv::Mat& picture) {
  if (looks_[look].strength * looks_[look].brushwork == 0 || looks_[look].mixture(layer).empty())
    return picture;
  if (!texture_ || texture_->first != shot) {
    texture_.reset();  // before the next one is made: it is large
    texture_.emplace(shot, SurfaceTexture(surface_flow_.rest_points(surface(shot))));
  }
  return stylizer_->with_brushwork(picture, texture_->second, look, layer);
}

cv::Mat FilmFrames::painted_picture(int shot, std::size_t look, Layer layer) {
  return colours_of(painted(shot, look, layer), entry(shot).frame);
}

LayerFrame FilmFrames::composed(int shot, std::size_t look, const std::function<cv::Mat(Layer)>& picture) {
  forget_all_but(shot - Film::reach, shot + Film::reach);
  const LayerFrame& plain = entry(shot).frame;
  const std::vector<Layer> layers = layers_to_paint(plain, looks_[look]);
  const cv::Mat first = picture(layers[0]);
  LayerFrame result{plain.width, plain.height, {}, plain.alpha, plain.person, plain.depth, {}};
  result.rgb.assign(floats_of(first).begin(), floats_of(first).end());
  if (layers.size() > 1) {
    const cv::Mat person = picture(layers[1]);
    for (std::size_t i = 0; i < plain.person.size(); ++i)
      for (int c = 0; c < 3; ++c)
        result.rgb[3 * i + c] += plain.person[i] * (person.ptr<float>()[3 * i + c] - result.rgb[3 * i + c]);
  }
  for (std::size_t i = 0; i < result.alpha.size(); ++i)
    for (int c = 0; c < 3; ++c) result.rgb[3 * i + c] *= result.alpha[i];
  return result;
}

LayerFrame FilmFrames::stylised(int shot, std::size_t look) {
  return composed(shot, look, [&](Layer layer) {
    if (looks_[look].strength == 0 || looks_[look].mixture(layer).empty())
      return painted_picture(shot, look, layer);
    return with_brushwork(shot, look, layer,
                          mean(shot, [&](int other) { return painted_picture(other, look, layer); }));
  });
}

LayerFrame FilmFrames::painted_alone(int shot, std::size_t look) {
  return composed(shot, look, [&](Layer layer) {
    return with_brushwork(shot, look, layer, painted_picture(shot, look, layer));
  });
}

cv::Mat FilmFrames::averaged(int shot, const std::vector<cv::Mat>& pictures) {
  forget_all_but(shot - Film::reach, shot + Film::reach);
  const cv::Mat colours = mean(shot, [&](int other) {
    cv::Mat picture;
    if (other >= 0 && other < static_cast<int>(pictures.size()))
      pictures[other].convertTo(picture, CV_32F, 1 / 255.0);
    return picture;
  });
  cv::Mat picture;
  colours.convertTo(picture, CV_8U, 255);
  return picture;
}

}  // namespace vivant
