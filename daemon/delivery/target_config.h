#pragma once

#include <optional>
#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace skullstation {

enum class DeliveryProtocol { folder, webdav, s3, sftp, dicom, stow, fhir };

/// "folder", "webdav", …
const char* to_string(DeliveryProtocol protocol);

/// One [[delivery.targets]] of station.toml: a receiver of packages. docs/delivery.md says which
/// protocol wants which keys; validate() refuses the others, so that nothing is configured in vain.
struct TargetConfig {
  std::string name;  ///< letters, digits, '-', '_'; names it in the outbox
  DeliveryProtocol protocol = DeliveryProtocol::folder;
  std::string address;  ///< an absolute path, or a URL without user and password
  bool enabled = true;
  std::string hours;  ///< UTC, "20:00-06:00": when it may be sent; empty: always

  std::string user;
  /// Where the password, token or key is, never what it is: the name of a systemd credential, or
  /// the path of a file that nobody else may read.
  std::string secret;
  std::string ca_file;           ///< PEM: who vouches for the receiver; empty: the system's list
  std::string certificate_file;  ///< PEM: this station's own
  std::string key_file;          ///< PEM: the key of it; for sftp the key to log in with
  std::string host_key_sha256;   ///< sftp: as `ssh-keygen -lf` prints it, "SHA256:…"
  std::string region;            ///< s3
  std::string called_ae;         ///< dicom: the receiver's AE title
  std::string calling_ae;        ///< dicom: this station's
  bool mounted = false;          ///< folder: must be another file system than the root's
  std::optional<int> max_photographs;  ///< dicom, stow: so many of them, evenly spread; unset: all

  /// The error's `where` is the key.
  Result<void> validate() const;
  /// May it be sent to at this time? (hours)
  bool open_at(UtcTime time) const;
};

}  // namespace skullstation
