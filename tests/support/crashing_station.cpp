// A station to be killed: saves fake scans and makes their jobs until it is ended, and writes a
// line for everything that it has acknowledged.  usage: crashing_station FOLDER SEED CASES

#include <fmt/format.h>
#include <unistd.h>

#include <thread>

#include "core/file.h"
#include "core/random.h"
#include "tests/support/steps.h"

namespace {

using namespace skullstation;
using namespace std::chrono_literals;

void acknowledge(const std::string& line) {
  const std::string text = line + "\n";
  static_cast<void>(!::write(STDOUT_FILENO, text.data(), text.size()));
}

int give_up(const Error& error) {
  acknowledge("error " + error.message());
  return 1;
}

}  // namespace

int main(int, char** words) {
  const std::filesystem::path folder = words[1];
  Random random(std::stoull(words[2]));
  const int cases_wanted = std::stoi(words[3]);
  const SystemClock clock;
  auto store = CaseStore::open(folder / "store", clock, "test");
  if (!store) return give_up(store.error());
  const StepChain chain = testing::fake_chain(
      fmt::format(R"({{"sleep_ms": 5, "claim": "{}"}})", (folder / "claim").string()),
      R"({"mark": "!"})");
  // An unfinished scan has been begun only: its pictures are another test's matter.
  if (const auto unfinished = (*store)->unfinished_scan(); unfinished && *unfinished) {
    if (auto ended = (*store)->give_up_scan((*unfinished)->id); !ended) {
      return give_up(ended.error());
    }
  }
  JobEngine engine(**store, testing::fake_engine_options(chain),
                   [](JobNews news, std::int64_t case_id) {
                     if (news == JobNews::case_done) acknowledge(fmt::format("done {}", case_id));
                   });
  for (int made = 0; made < cases_wanted; ++made) {
    const auto scanned =
        testing::scan_fake_case(**store, fmt::format("n{}", random.below(1000000)), chain);
    if (!scanned) return give_up(scanned.error());
    acknowledge(fmt::format("saved {} {}", scanned->id, scanned->number));
    engine.wake();
    if (random.below(3) == 0) {
      const auto anew = (*store)->rerun(scanned->id, "second", R"({"mark": "?"})");
      if (anew) acknowledge(fmt::format("rerun {} {}", scanned->id, *anew));
      engine.wake();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(random.below(15)));
  }
  while (!(*store)->outstanding()->empty()) std::this_thread::sleep_for(2ms);
  acknowledge("all done");
  return 0;
}
