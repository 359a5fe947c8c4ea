#include "daemon/delivery/target_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "daemon/station/station_config.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

TargetConfig sound(DeliveryProtocol protocol, std::string address) {
  TargetConfig target;
  target.name = "records";
  target.protocol = protocol;
  target.address = std::move(address);
  return target;
}

TargetConfig sound_sftp() {
  TargetConfig target = sound(DeliveryProtocol::sftp, "sftp://host:22/in");
  target.user = "station";
  target.key_file = "/etc/key";
  target.host_key_sha256 = "SHA256:" + std::string(43, 'A');
  return target;
}

std::string fault_of(const TargetConfig& target) {
  const auto valid = target.validate();
  return valid ? "" : valid.error().message();
}

TEST(TargetConfig, SoundOnesPass) {
  EXPECT_EQ(fault_of(sound(DeliveryProtocol::folder, "/mnt/records")), "");
  EXPECT_EQ(fault_of(sound(DeliveryProtocol::webdav, "https://records.example/in")), "");
  EXPECT_EQ(fault_of(sound(DeliveryProtocol::fhir, "http://127.0.0.1:8080/fhir")), "");
  EXPECT_EQ(fault_of(sound(DeliveryProtocol::stow, "http://[::1]/dicom-web")), "");
  EXPECT_EQ(fault_of(sound_sftp()), "");
  TargetConfig dicom = sound(DeliveryProtocol::dicom, "dicoms://pacs:2762");
  dicom.called_ae = "PACS";
  dicom.calling_ae = "STATION";
  dicom.ca_file = "/etc/ca.pem";
  EXPECT_EQ(fault_of(dicom), "");
}

TEST(TargetConfig, EvidenceNeverLeavesTheMachineUnencrypted) {
  for (const char* address : {"http://records.example", "http://localhost.example/",
                              "http://127.0.0.1.example", "ftp://records.example"}) {
    EXPECT_THAT(fault_of(sound(DeliveryProtocol::webdav, address)), HasSubstr("https://"))
        << address;
  }
  EXPECT_EQ(fault_of(sound(DeliveryProtocol::webdav, "http://localhost/")), "");
}

TEST(TargetConfig, MistakesAreNamedByTheirKey) {
  EXPECT_THAT(fault_of(sound(DeliveryProtocol::folder, "mnt")),
              HasSubstr("address: must be an abs"));
  EXPECT_THAT(fault_of(sound(DeliveryProtocol::webdav, "https://me:secret@host/")),
              HasSubstr("holds a user or a password"));
  EXPECT_THAT(fault_of(sound(DeliveryProtocol::webdav, "https://host/?a=b")), HasSubstr("blanks"));
  EXPECT_THAT(fault_of(sound(DeliveryProtocol::s3, "https://host/bucket")),
              HasSubstr("user: is needed for s3"));
  TargetConfig target = sound(DeliveryProtocol::folder, "/mnt");
  target.region = "eu";
  EXPECT_THAT(fault_of(target), HasSubstr("region: means nothing for folder"));
  target = sound(DeliveryProtocol::folder, "/mnt");
  target.name = "a b";
  EXPECT_THAT(fault_of(target), HasSubstr("name: must be letters"));
  target = sound_sftp();
  target.host_key_sha256 = "";
  EXPECT_THAT(fault_of(target), HasSubstr("host_key_sha256: is needed"));
  target.host_key_sha256 = "md5";
  EXPECT_THAT(fault_of(target), HasSubstr("ssh-keygen"));
  target = sound_sftp();
  target.secret = "too";
  EXPECT_THAT(fault_of(target), HasSubstr("one of the two"));
  target = sound(DeliveryProtocol::webdav, "https://host");
  target.key_file = "/k";
  EXPECT_THAT(fault_of(target), HasSubstr("need each other"));
  target = sound(DeliveryProtocol::webdav, "https://host");
  target.user = "me";
  EXPECT_THAT(fault_of(target), HasSubstr("secret: is needed with user"));
  target = sound(DeliveryProtocol::dicom, "dicoms://host");
  target.called_ae = "LONGER THAN SIXTEEN";
  target.calling_ae = "S";
  target.ca_file = "/ca";
  EXPECT_THAT(fault_of(target), HasSubstr("called_ae: must be at most 16"));
  target.called_ae = "S";
  target.ca_file = "";
  EXPECT_THAT(fault_of(target), HasSubstr("ca_file: is needed"));
}

TEST(TargetConfig, HoursMayPassMidnight) {
  TargetConfig target = sound(DeliveryProtocol::folder, "/mnt");
  const UtcTime noon{std::chrono::hours(12)};
  EXPECT_TRUE(target.open_at(noon));
  target.hours = "20:00-06:30";
  EXPECT_EQ(fault_of(target), "");
  EXPECT_FALSE(target.open_at(noon));
  EXPECT_TRUE(target.open_at(noon + std::chrono::hours(9)));
  EXPECT_TRUE(target.open_at(noon + std::chrono::hours(18)));
  EXPECT_FALSE(target.open_at(noon + std::chrono::minutes(18 * 60 + 30)));
  for (const char* hours : {"20-6", "25:00-06:00", "20:61-06:00", "20:00-06:00x", "-1:00-02:00"}) {
    target.hours = hours;
    EXPECT_THAT(fault_of(target), HasSubstr("hours: must be like")) << hours;
  }
}

TEST(TargetConfig, StandsInStationTomlWithStrictKeys) {
  const TemporaryFolder folder;
  const auto file = folder / "station.toml";
  ASSERT_TRUE(write_file_durably(file,
                                 "[delivery]\nfolder = \"/var/outbox\"\n[[delivery.targets]]\n"
                                 "name = \"a\"\nprotocol = \"stow\"\naddress = \"https://h/d\"\n"
                                 "max_photographs = 12\n"));
  const auto config = read_config(file);
  ASSERT_TRUE(config) << config.error().message();
  ASSERT_EQ(config->delivery.targets.size(), 1U);
  EXPECT_EQ(config->delivery.targets[0].protocol, DeliveryProtocol::stow);
  EXPECT_EQ(config->delivery.targets[0].max_photographs, 12);

  ASSERT_TRUE(write_file_durably(file,
                                 "[[delivery.targets]]\nname = \"a\"\nprotocol = \"folder\"\n"
                                 "address = \"relative\"\npassword = \"x\"\n"
                                 "[[delivery.targets]]\nname = \"a\"\nprotocol = \"folder\"\n"
                                 "address = \"/mnt\"\n"));
  std::string problems;
  for (const Error& problem : load_config(file).problems) problems += problem.message() + "\n";
  EXPECT_THAT(problems, HasSubstr("station.toml:5: unknown key \"delivery.targets[0].password\""));
  EXPECT_THAT(problems, HasSubstr("station.toml:4: delivery.targets[0].address must be an abs"));
  EXPECT_THAT(problems, HasSubstr("\"a\" is used twice"));
}

}  // namespace
}  // namespace skullstation
