#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "daemon/delivery/delivery.h"
#include "tests/servers/receivers.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/delivery/sealed_case.h"

namespace skullstation::testing {

/// Deliveries to real receivers on a loopback of their own: what arrives, what is refused, what is
/// told. SKULLSTATION_LONG=1: with 55 MB instead of 2.
class Servers : public ::testing::Test {
 protected:
  /// Skips where a program is missing, or servers can't be started here.
  static void need(const std::vector<std::string>& programs);

  /// What is delivered, sealed once for all tests.
  static const SealedPackage& package();
  std::vector<DeliveryObject> objects(const TargetConfig& target);

  Result<std::string> deliver(const TargetConfig& target);
  /// Empty if everything was read back and equal, else what went wrong.
  std::string arrives(const TargetConfig& target);
  /// The words of a failure; its kind as wanted.
  std::string fails(const TargetConfig& target, ErrorKind kind);
  /// Empty if a probe came back, and was removed again or not, as wanted.
  std::string probe(const TargetConfig& target, bool removed);

  std::filesystem::path make(const std::string& name);
  /// A folder on a file system of its own that is soon full ("256k"), until the end of the test.
  /// Skips, and is false, where nothing can be mounted.
  bool make_small_disk(const std::string& name, const std::string& size);
  /// A file that holds a secret as the station wants it.
  std::string secret(const std::string& text);
  static TargetConfig target(DeliveryProtocol protocol, const std::string& address);
  static TargetConfig with_certificate(TargetConfig config);

  void expect_whole_package(const std::filesystem::path& root);
  /// Somebody was there before with other bytes under the name of the first object.
  std::string finds_other_bytes(const TargetConfig& config,
                                const std::function<void(std::string&)>& change);
  /// Cuts the connection at 20 places, then lets it through.
  void survives_cuts(const TargetConfig& config, int from, int to, std::size_t most);

  TemporaryFolder folder_;

 private:
  /// Destroyed before the folder in which they lie.
  struct SmallDisks {
    std::vector<std::filesystem::path> mounted;
    ~SmallDisks();
  } small_disks_;
};

}  // namespace skullstation::testing
