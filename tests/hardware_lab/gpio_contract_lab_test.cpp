// The contract of the station's hardware, fulfilled by the GPIO backend on a kernel's chip.

#include "tests/contract/interlock_contract.h"
#include "tests/contract/panel_contract.h"
#include "tests/contract/turntable_contract.h"
#include "tests/hardware_lab/gpio_sim_world.h"

namespace skullstation::contract {
namespace {

const auto gpio_sim = testing::Values(HardwareKind{"GpioSim", [](const WorldOptions& options) {
                                                     return std::make_unique<GpioSimWorld>(options);
                                                   }});

INSTANTIATE_TEST_SUITE_P(Kernel, InterlockContract, gpio_sim, name_of);
INSTANTIATE_TEST_SUITE_P(Kernel, PanelContract, gpio_sim, name_of);
INSTANTIATE_TEST_SUITE_P(Kernel, TurntableContract, gpio_sim, name_of);
INSTANTIATE_TEST_SUITE_P(Kernel, HomedTurntableContract, gpio_sim, name_of);

}  // namespace
}  // namespace skullstation::contract
