#include "vivant/jobs/batch.hpp"

#include "io_helpers.hpp"
#include "tiny_run.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/video.hpp"

using namespace vivant;
namespace fs = std::filesystem;

namespace {

std::vector<BatchJob> jobs_of(const TemporaryFolder& folder, const std::string& text) {
  write_file(folder / "jobs.toml", text);
  return load_batch(folder / "jobs.toml");
}

/// The message of the usage error that this file gives, without its path.
std::string refusal(const std::string& text) {
  const TemporaryFolder folder;
  const std::string message = error_of([&] { jobs_of(folder, text); });
  const std::size_t name = message.find("jobs.toml");
  return name == std::string::npos ? message : message.substr(name);
}

std::vector<BatchResult> make(Device& device, const std::vector<BatchJob>& jobs) {
  Progress progress(ProgressMode::none, false);
  return run_batch(device, jobs, progress);
}

std::string bytes_of(const fs::path& path) { return fs::exists(path) ? read_whole_file(path) : ""; }

}  // namespace

TEST_CASE("batch file: lists multiply, keys at the top are defaults, paths are relative to the file") {
  const TemporaryFolder folder;
  const std::vector<BatchJob> jobs = jobs_of(folder,
                                             "output = \"films\"\n"
                                             "size = \"48x36\"\n"
                                             "style = [\"none\", \"styles/wave.jpg\"]\n"
                                             "[[job]]\n"
                                             "run = [\"runs/a\", \"runs/b/\"]\n"
                                             "views = [\"train\", \"path.json\"]\n"
                                             "motion = [\"own\", \"dance.bvh\"]\n"
                                             "[[job]]\n"
                                             "run = \"/far/c\"\n"
                                             "name = \"elsewhere\"\n"
                                             "scene = \"runs/a\"\n"
                                             "place = \"1,2,3,4,0.5\"\n"
                                             "style = \"none\"\n"
                                             "size = \"20x10\"\n"
                                             "frames = \"2:5\"\n"
                                             "strength = 0.5\n");
  REQUIRE(jobs.size() == 9);
  CHECK(jobs[0].run == folder / "runs/a");
  CHECK(jobs[0].film.views == "train");
  CHECK(jobs[0].film.motion.empty());
  CHECK(jobs[0].film.size == std::pair(48, 36));
  REQUIRE(jobs[0].films.size() == 2);
  CHECK(jobs[0].films[0].folder == folder / "films/a/train");
  CHECK(!jobs[0].films[0].look.stylised());
  CHECK(jobs[0].films[1].folder == folder / "films/a/train-wave");
  CHECK(jobs[0].films[1].look.person == StyleMixture{{folder / "styles/wave.jpg"}});
  CHECK(!jobs[0].films[1].look.layered());
  CHECK(jobs[3].film.views == folder / "path.json");
  CHECK(jobs[3].film.motion == folder / "dance.bvh");
  CHECK(jobs[3].films[1].folder == folder / "films/a/path-dance-wave");
  CHECK(jobs[7].films[0].folder == folder / "films/b/path-dance");
  const BatchJob& last = jobs[8];
  CHECK(last.run == "/far/c");
  CHECK(last.scene == folder / "runs/a");
  CHECK(last.film.place == Place{{1, 2, 3}, 4, 0.5});
  CHECK(last.film.views == "first");
  CHECK(last.film.size == std::pair(20, 10));
  CHECK(last.film.frames == std::pair(2, 5));
  CHECK(last.films[0].look.strength == 0.5);
  REQUIRE(last.films.size() == 1);
  CHECK(last.films[0].folder == folder / "films/elsewhere/first");
}

TEST_CASE("batch file: mixtures of styles, and styles of the layers") {
  const TemporaryFolder folder;
  const std::vector<BatchJob> jobs = jobs_of(folder,
                                             "style = [\"a.jpg\", [\"b.jpg:0.7\", \"c.jpg:0.3\"]]\n"
                                             "[[job]]\n"
                                             "run = \"r\"\n"
                                             "[[job]]\n"
                                             "run = \"r\"\n"
                                             "keep_colour = true\n"
                                             "brushwork = 0.5\n"
                                             "person_style = \"none\"\n");
  REQUIRE(jobs.size() == 2);
  REQUIRE(jobs[0].films.size() == 2);
  CHECK(jobs[0].films[1].folder == folder / "films/r/test-b-c");
  CHECK(jobs[0].films[1].look.scene == StyleMixture{{folder / "b.jpg", 0.7}, {folder / "c.jpg", 0.3}});
  CHECK(!jobs[0].films[1].look.keep_colour);
  CHECK(jobs[0].films[1].look.brushwork == 1);
  const BatchFilm& film = jobs[1].films.at(0);
  CHECK(film.folder == folder / "films/r/test-person-none-scene-a");
  CHECK(film.look.person.empty());
  CHECK(film.look.scene == StyleMixture{{folder / "a.jpg"}});
  CHECK(film.look.keep_colour);
  CHECK(film.look.brushwork == 0.5);
}

TEST_CASE("batch file: what is wrong is said with its line, in one line") {
  const std::string job = "[[job]]\nrun = \"a\"\n";
  CHECK(refusal(job + "veiws = \"test\"\n") ==
        "jobs.toml line 3: unknown key 'veiws': did you mean 'views'?");
  CHECK(refusal("stile = \"x\"\n" + job) == "jobs.toml line 1: unknown key 'stile': did you mean 'style'?");
  CHECK(refusal(job + "brushwork = 3\n") ==
        "jobs.toml line 3: brushwork: it must be a number from 0 to 2, not 3");
  CHECK(contains(refusal("[[jobs]]\nrun = \"a\"\n"), "unknown key 'jobs': did you mean 'job'?"));
  CHECK(contains(refusal("[job]\nrun = \"a\"\n"), "it has no [[job]]"));
  CHECK(contains(refusal(""), "it has no [[job]]"));
  CHECK(contains(refusal("[[job]]\nviews = \"test\"\n"), "line 1: the job has no 'run'"));
  CHECK(contains(refusal(job + "views = \"tset\"\n"), "line 3: views: unknown views 'tset'"));
  CHECK(contains(refusal(job + "views = []\n"), "line 3: views: it must be a text or a list of texts"));
  CHECK(contains(refusal(job + "style = [\"a\", 3]\n"),
                 "line 3: style: it must be a text, or a list of texts"));
  CHECK(contains(refusal(job + "style = [[\"a:1\", \"b:-1\"]]\n"), "line 3: style: a style is IMAGE"));
  CHECK(contains(refusal(job + "person_style = [\"a\", \"none\"]\n"), "'none' stands alone"));
  CHECK(contains(refusal(job + "size = \"48\"\n"), "line 3: size: a size is WIDTHxHEIGHT"));
  CHECK(
      contains(refusal(job + "strength = 2\n"), "line 3: strength: it must be a number from 0 to 1, not 2"));
  CHECK(contains(refusal(job + "orbit_frames = 2.5\n"), "it must be a whole number"));
  CHECK(contains(refusal(job + "layers = \"all\"\n"), "it must be both, scene or human"));
  CHECK(contains(refusal(job + "frames = \"5:5\"\n"), "frames are FIRST:END"));
  CHECK(contains(refusal(job + job), "films/a/test.mp4: give a job another 'name'"));
  CHECK(contains(refusal(job + "style = [\"x/a.jpg\", \"y/a.jpg\"]\n"), "two films would be"));
  CHECK(contains(refusal("[[job]\n"), "jobs.toml line 1: broken TOML"));
}

TEST_CASE("batch: frames are made once, kept, and gone on from; a failure stops no other film") {
  const TemporaryFolder folder;
  Device device;
  make_tiny_run(device, folder / "walk", true);
  write_image(folder / "style.png", cv::Mat(64, 64, CV_8UC3, cv::Scalar(200, 100, 50)));
  const std::string text =
      "run = \"walk/run\"\n"
      "name = \"walk\"\n"
      "[[job]]\n"
      "run = \"nowhere\"\n"
      "name = \"nowhere\"\n"
      "[[job]]\n"
      "views = [\"test\", \"train\"]\n"
      "[[job]]\n"
      "motion = \"walk/capture/truth/novel_poses/poses.safetensors\"\n"
      "layers = \"human\"\n"
      "frames = \"0:3\"\n"
      "style = [\"none\", \"missing.jpg\", \"style.png\"]\n";
  const fs::path films = folder / "films/walk";
  std::vector<BatchResult> results = make(device, jobs_of(folder, text));
  REQUIRE(results.size() == 6);
  CHECK(contains(results[0].error, "nowhere"));
  for (const std::size_t good : {1, 2, 3}) {
    CAPTURE(results[good].error);
    CHECK(results[good].error.empty());
    CHECK(results[good].made == results[good].frames);
    VideoReader video(results[good].film);
    int frames = 0;
    while (video.next()) ++frames;
    CHECK(frames == results[good].frames);
  }
  CHECK(results[1].frames == 2);
  CHECK(results[2].frames == 7);
  CHECK(results[3].frames == 3);
  CHECK(contains(results[4].error, "missing.jpg"));
  CHECK(contains(results[5].error, "has learned no features"));
  CHECK(read_image_with_alpha(films / "first-poses/0002.png").type() == CV_8UC4);
  const std::string table = batch_table(results);
  CHECK(std::count(table.begin(), table.end(), '\n') == 7);
  CHECK(contains(table, "failed: "));

  // A second call makes what is missing alone, and the same bits.
  const std::string picture = bytes_of(films / "train/0003.png"), film = bytes_of(films / "train.mp4");
  fs::remove(films / "train/0003.png");
  fs::remove(films / "first-poses.mp4");
  results = make(device, jobs_of(folder, text));
  CHECK(results[1].made == 0);
  CHECK(results[2].made == 1);
  CHECK(results[3].made == 0);
  CHECK(bytes_of(films / "train/0003.png") == picture);
  CHECK(bytes_of(films / "train.mp4") == film);
  CHECK(fs::exists(films / "first-poses.mp4"));

  // Pictures of other settings are not mixed in.
  results = make(device, jobs_of(folder, "size = \"24x18\"\n" + text));
  CHECK(contains(results[2].error, "(size was \"own\", now \"24x18\")"));
  CHECK(read_image(films / "train/0003.png").cols == 48);
  // A film whose pictures are gone is made anew.
  fs::remove_all(films / "test");
  write_file(films / "test/notes.txt", "");
  results = make(device, jobs_of(folder, text));
  CHECK(contains(results[1].error, "is not empty and holds no film.json"));
}
