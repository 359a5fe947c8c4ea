#include "tests/support/steps.h"

#include <fmt/format.h>

#include <chrono>

#include "core/file.h"
#include "tests/support/process.h"

namespace skullstation::testing {

using namespace std::chrono_literals;

StepChain fake_chain(const std::string& first, const std::string& second) {
  const auto step = [](const char* name, const char* input, const std::string& options) {
    StepKind kind;
    kind.name = name;
    kind.inputs = {input};
    kind.promises = {"made.txt"};
    kind.options = options;
    kind.space_bytes = 0;
    kind.limits = {std::uint64_t{256} << 20, std::uint64_t{16} << 20, 20s, 20s};
    return kind;
  };
  return {step("first", "scan", first), step("second", "first", second)};
}

std::vector<std::string> fake_step_command() {
  return {(skullstation_program().parent_path() / "fake_step").string()};
}

EngineOptions fake_engine_options(StepChain chain) {
  EngineOptions options;
  options.chain = std::move(chain);
  options.step_command = fake_step_command();
  options.grace = 50ms;
  options.retry_pause = 20ms;
  return options;
}

Result<Case> scan_fake_case(CaseStore& store, const std::string& number, const StepChain& chain,
                            int pictures) {
  auto begun = store.begin_scan(number);
  if (!begun) return begun;
  const auto images = store.scan_folder(begun->id) / "images";
  if (auto made = make_writable_folder(images); !made) return forward(made);
  for (int i = 0; i < pictures; ++i) {
    const auto written =
        write_file_durably(images / fmt::format("{}.png", i), fmt::format("<{}-{}>", number, i));
    if (!written) return forward(written);
  }
  if (auto saved = store.save_scan(begun->id, chain); !saved) return forward(saved);
  return store.case_of(begun->id);
}

}  // namespace skullstation::testing
