#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/clock.h"
#include "daemon/jobs/case_store.h"
#include "daemon/jobs/job_engine.h"

namespace skullstation::testing {

/// A chain of two quick steps, "first" on the scan and "second" on the first, made by fake_step
/// (tests/support/fake_step.cpp), which does what their options say.
StepChain fake_chain(const std::string& first = "{}", const std::string& second = "{}");
std::vector<std::string> fake_step_command();
EngineOptions fake_engine_options(StepChain chain);

/// Begins a case, writes `pictures` small files as its session, saves it.
Result<Case> scan_fake_case(CaseStore& store, const std::string& number, const StepChain& chain,
                            int pictures = 3);

}  // namespace skullstation::testing
