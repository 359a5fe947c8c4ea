#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/photogrammetry/bench_scene.h"
int main(int argc, char** argv) {
  skullstation::BenchScene scene;
  std::string cache;
  int threads = 0;
  CLI::App app("x");
  app.add_option("--specimen", scene.specimen, "");
  app.add_option("--cache", cache, "")->required();
  app.add_option("--views", scene.views, "");
  app.add_option("--width", scene.width, "");
  app.add_option("--height", scene.height, "");
  app.add_option("--threads", threads, "");
  CLI11_PARSE(app, argc, argv);
  const auto done = skullstation::cached_scene(scene, cache, threads);
  if (!done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return 1;
  }
  fmt::print("{}\n", done->string());
}
