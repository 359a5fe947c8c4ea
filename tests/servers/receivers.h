#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation::testing {

/// Puts this program into a network and mounts of its own, so that servers which listen everywhere
/// are reached by nobody else. Empty if that worked, else why not.
std::string enter_own_network();

/// Certificates made for one run: an authority, a server's for localhost and one that has expired,
/// a client's, and one of somebody whom nobody knows.
class Certificates {
 public:
  Certificates();
  std::string ca() const { return folder_ / "ca.pem"; }
  std::string server_chain() const { return folder_ / "server.pem"; }
  std::string server_key() const { return folder_ / "server.key"; }
  std::string expired_chain() const { return folder_ / "expired.pem"; }
  std::string expired_key() const { return folder_ / "expired.key"; }
  std::string client() const { return folder_ / "client.pem"; }
  std::string client_key() const { return folder_ / "client.key"; }
  std::string rogue() const { return folder_ / "rogue.pem"; }
  std::string rogue_key() const { return folder_ / "rogue.key"; }

 private:
  TemporaryFolder folder_;
};
const Certificates& certificates();

/// A server that listens on the port of 127.0.0.1; ended with this object.
class Receiver {
 public:
  /// Fails the test if it does not listen within half a minute.
  Receiver(const std::vector<std::string>& command, int port);
  ~Receiver();

 private:
  Process process_;
};

/// nginx on 18444: WebDAV in `root` for clients with a certificate, as the paths of `pki` say;
/// on 18443: the same in front of Orthanc.
std::unique_ptr<Receiver> start_nginx(const std::filesystem::path& folder,
                                      const std::filesystem::path& root, bool expired = false);
/// Apache on 18445, WebDAV in `root`.
std::unique_ptr<Receiver> start_apache(const std::filesystem::path& folder,
                                       const std::filesystem::path& root);
/// sshd on 12222 for this user and the key folder/id; its files in `folder`.
std::unique_ptr<Receiver> start_sshd(const std::filesystem::path& folder);
/// "SHA256:…" of a public key file.
std::string fingerprint_of(const std::filesystem::path& public_key);
/// Orthanc on 14242 (DICOM, TLS if wanted) and 18042 (DICOMweb, plain).
std::unique_ptr<Receiver> start_orthanc(const std::filesystem::path& folder, bool tls);
/// Doubles in Python: S3 that recomputes each signature, on 19000; FHIR R4 on 19001.
std::unique_ptr<Receiver> start_s3(const std::filesystem::path& folder, const std::string& secret);
std::unique_ptr<Receiver> start_fhir(const std::filesystem::path& folder, const std::string& token);

/// Passes bytes on from 127.0.0.1:`from` to `to` and cuts each connection when so many have gone
/// to the server.
class CuttingProxy {
 public:
  CuttingProxy(int from, int to, std::size_t bytes);
  ~CuttingProxy();

 private:
  pid_t child_ = -1;
};

}  // namespace skullstation::testing
