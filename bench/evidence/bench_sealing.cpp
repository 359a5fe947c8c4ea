// How fast a package is sealed and verified, beside what nobody can do without: SHA-256 and a
// durable write of the same bytes in one run, on one thread. Memory is the process's peak.

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <string>

#include "bench/seconds.h"
#include "core/file.h"
#include "core/file_descriptor.h"
#include "core/random.h"
#include "core/sha256.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/package_check.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;

struct Options {
  fs::path folder;
  double gigabytes = 1.0;
  int files = 8;
  int runs = 3;
  int threads = 0;
};

constexpr std::size_t piece_bytes = 4 * 1024 * 1024;

/// A case whose files hold noise: `gigabytes` in `files` of them.
Result<void> write_case(const Options& options, const fs::path& folder) {
  fs::create_directories(folder);
  const std::string record = fmt::format(
      R"({{"format":"skullstation-case/1","input":{{"sha256":"{}"}}}})", std::string(64, '0'));
  if (const auto written = write_file_durably(folder / "case.json", record); !written) {
    return written;
  }
  Random random(1);
  std::string piece(piece_bytes, '\0');
  for (char& c : piece) c = static_cast<char>(random.bits());
  const auto pieces = static_cast<int>(options.gigabytes * 1e9 / options.files / piece_bytes);
  for (int f = 0; f < options.files; ++f) {
    const fs::path path = folder / fmt::format("part_{}.bin", f);
    const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644));
    for (int p = 0; p < pieces; ++p) {
      piece[static_cast<std::size_t>(p)] ^= 1;  // no two pieces alike
      if (const int failure = write_all(file, piece); failure != 0) {
        return write_error(path, failure);
      }
    }
  }
  return {};
}

/// Reads each file once, sums it, writes it, syncs it.
Result<void> sum_and_write(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  std::string piece(piece_bytes, '\0');
  for (const auto& entry : fs::directory_iterator(from)) {
    const fs::path path = to / entry.path().filename();
    const FileDescriptor in(::open(entry.path().c_str(), O_RDONLY));
    const FileDescriptor out(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644));
    Sha256 sum;
    for (ssize_t got = 0; (got = ::read(in.get(), piece.data(), piece.size())) > 0;) {
      const std::string_view bytes(piece.data(), static_cast<std::size_t>(got));
      sum.update(bytes);
      if (const int failure = write_all(out, bytes); failure != 0) {
        return write_error(path, failure);
      }
    }
    (void)sum.finish();
    if (::fsync(out.get()) != 0) return write_error(path, errno);
  }
  return {};
}

void print_row(const char* what, double megabytes, const Seconds& best, double peak_gib) {
  fmt::print("{:<36}{:>10.2f}{:>13.2f}{:>10.0f}{:>12.3f}\n", what, best.wall, best.processor,
             megabytes / best.wall, peak_gib);
}

Result<void> run(const Options& options) {
  const fs::path source = options.folder / "case";
  if (const auto written = write_case(options, source); !written) return written;
  if (const auto made = create_station_keys(options.folder / "keys", {"BENCH"}, SystemClock());
      !made) {
    return made;
  }
  const auto keys = read_station_keys(options.folder / "keys");
  if (!keys) return forward(keys);
  PackageSource what;
  what.case_folder = source;
  double megabytes = 0.0;
  Seconds plain{1e9, 0}, seal{1e9, 0}, verify{1e9, 0};
  double plain_peak = 0.0, seal_peak = 0.0;
  const auto better = [](Seconds& best, const Seconds& now) {
    if (now.wall < best.wall) best = now;
  };
  for (int r = 0; r < options.runs; ++r) {
    Seconds start = Seconds::now();
    if (const auto done = sum_and_write(source, options.folder / "plain"); !done) return done;
    better(plain, Seconds::now() - start);
    fs::remove_all(options.folder / "plain");
    plain_peak = std::max(plain_peak, r == 0 ? peak_memory_gib() : 0.0);
    start = Seconds::now();
    const auto sealed = write_package(what, {*keys, std::nullopt, "bench", {}}, SystemClock(),
                                      options.folder / "bag", options.threads);
    if (!sealed) return forward(sealed);
    better(seal, Seconds::now() - start);
    seal_peak = peak_memory_gib();
    megabytes = static_cast<double>(sealed->bytes) / 1e6;
    start = Seconds::now();
    const auto checked = check_package(options.folder / "bag", std::nullopt);
    if (!checked) return forward(checked);
    if (!checked->findings.empty()) {
      return fail(ErrorKind::no_result, "bag", checked->findings.front().what);
    }
    better(verify, Seconds::now() - start);
    fs::remove_all(options.folder / "bag");
  }
  fmt::print("{:.0f} MB in {} files, best of {} runs\n{:<36}{:>10}{:>13}{:>10}{:>12}\n", megabytes,
             options.files, options.runs, "", "wall s", "processor s", "MB/s", "peak GiB");
  print_row("SHA-256 + durable write, one thread", megabytes, plain, plain_peak);
  print_row("seal", megabytes, seal, seal_peak);
  print_row("verify", megabytes, verify, peak_memory_gib());
  fmt::print("sealing has {:.0f} % of that speed (reference: >= 80 %)\n",
             100.0 * plain.wall / seal.wall);
  return {};
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  skullstation::Options options;
  CLI::App app("Speed and memory of sealing and verifying a package");
  app.add_option("--folder", options.folder, "new; needs twice the size, is removed at the end")
      ->required()
      ->check(CLI::NonexistentPath);
  app.add_option("--gigabytes", options.gigabytes, "of the case")->capture_default_str();
  app.add_option("--files", options.files, "of the case")->capture_default_str();
  app.add_option("--runs", options.runs, "the best counts")->capture_default_str();
  app.add_option("--threads", options.threads, "0: all");
  CLI11_PARSE(app, argc, argv);
  const auto done = skullstation::run(options);
  std::filesystem::remove_all(options.folder);
  if (!done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
