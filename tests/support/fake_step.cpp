// A step for the tests of the job engine: `fake_step NAME FOLDER` does what the options in
// FOLDER/request.json say. It is built without sanitizers, which would not fit into small memory.

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) {
    std::fprintf(stderr, "fake_step: %s can't be written\n", file.c_str());
    std::exit(3);
  }
}

/// Fails loudly if another step of the same name works at the same time.
void claim(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT, 0600);
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    write(file + ".twice", "two at once");
    std::exit(99);
  }
}

fs::path input_folder(const Json& request, const char* input) {
  return request["inputs"][input].get<std::string>();
}

std::string sha256(const fs::path& file) {
  char sum[65] = {};
  std::FILE* tool = ::popen(("sha256sum " + file.string()).c_str(), "r");
  if (tool == nullptr || std::fread(sum, 1, 64, tool) != 64 || ::pclose(tool) != 0) std::exit(4);
  return sum;
}

void eat_memory() {
  std::vector<char*> blocks;
  for (;;) {
    blocks.push_back(new char[1 << 20]);  // throws std::bad_alloc, which nobody catches
    std::memset(blocks.back(), 1, 1 << 20);
  }
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) return 2;
  const std::string name = words[1];
  const fs::path folder = words[2];
  const Json request = Json::parse(content(folder / "request.json"));
  Json options = request["options"];
  // A daemon's steps have options of their own; a file in its storage, two levels up, adds more.
  const fs::path storage = folder.parent_path().parent_path();
  if (const std::string more = content(storage / "step-options"); !more.empty()) {
    options.update(Json::parse(more));
  }
  const fs::path out = request["out"].get<std::string>();
  if (options.contains("claim")) claim(options["claim"]);
  std::printf("{\"fraction\": 0.5, \"stage\": \"half way\"}\n");
  std::fflush(stdout);
  std::this_thread::sleep_for(std::chrono::milliseconds(options.value("sleep_ms", 0)));

  while (fs::exists(storage / "hold-steps")) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const std::string what = options.value("do", "");
  if (what == "fail") {
    std::fprintf(stderr, "fake_step: the skull is made of cheese\n");
    return options.value("code", 5);
  }
  if (what == "segfault") std::raise(SIGSEGV);
  if (what == "eat memory") eat_memory();
  if (what == "hang") {
    std::signal(SIGTERM, SIG_IGN);
    for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  if (what == "spin") {
    const auto for_ever = std::chrono::steady_clock::time_point::max();
    while (std::chrono::steady_clock::now() < for_ever) {
    }
  }
  if (what == "leave a child") {
    if (::fork() == 0) {
      ::sleep(1000);
      std::_Exit(0);
    }
  }
  // Of a true session a true package is made.
  if (name == "seal" && fs::exists(input_folder(request, "scan") / "session.json")) {
    const std::string program =
        (fs::read_symlink("/proc/self/exe").parent_path() / "skullstation").string();
    ::execl(program.c_str(), program.c_str(), "step", "seal", folder.c_str(), nullptr);
    return 4;
  }
  fs::create_directories(out);
  if (what == "garbage") {
    for (int i = 0; i < 1000; ++i) std::printf("\xff\x00\x01{]garbage %d", i);
    std::fprintf(stderr, "\xff\xfe\x80");
    write(folder / "result.json", "{not json");
    return 0;  // and leaves nothing that was promised
  }
  if (what == "link") fs::create_symlink("/etc/passwd", out / "passwd");
  if (what == "big file") write(out / "big", std::string(std::size_t{64} << 20, 'x'));
  std::string text = name + "(";
  for (const auto& [input, place] : request["inputs"].items()) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(place.get<std::string>())) {
      if (entry.is_regular_file()) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) text += content(file);
  }
  text += ")" + options.value("mark", "");
  if (what == "network") {
    text = ::socket(AF_INET, SOCK_STREAM, 0) < 0 ? "no network" : "network";
    text += ::socket(AF_INET6, SOCK_DGRAM, 0) < 0 ? ", none at all" : ", some";
  }
  if (name == "reconstruct") {
    write(out / "skull.ply", text);
    write(out / "quality.json", R"({"format": "skullstation-reconstruction-quality/1"})");
    write(out / "cameras.json", content(input_folder(request, "scan") / "session.json"));
  }
  if (name == "approximate") {
    const std::string skull = sha256(input_folder(request, "reconstruct") / "skull.ply");
    const Json record = {{"format", "skullstation-case/1"},
                         {"input", {{"file", "skull.ply"}, {"sha256", skull}}}};
    write(out / "case.json", record.dump());
    for (const char* file : {"head.ply", "report.html"}) write(out / file, text);
  }
  if (name == "seal") {
    fs::create_directories(out / "signature");
    for (const char* file :
         {"bagit.txt", "manifest-sha256.txt", "tagmanifest-sha256.txt", "signature/ed25519.sig"}) {
      write(out / file, text);
    }
  }
  write(out / "made.txt", text + std::string(options.value("bytes", std::size_t{0}), 'x'));
  write(folder / "result.json", "{\"letters\": " + std::to_string(text.size()) + "}");
  return 0;
}
