#include "tests/unit/evidence/time_stamp_authority.h"

#include <stdexcept>

#include "core/file.h"
#include "tests/support/process.h"

namespace skullstation::testing {

namespace fs = std::filesystem;

namespace {

constexpr const char* config = R"([req]
distinguished_name = name
x509_extensions = stamps
prompt = no
[name]
CN = Authority
[stamps]
extendedKeyUsage = critical, timeStamping
[tsa]
default_tsa = station
[station]
serial = serial
signer_digest = sha256
default_policy = 1.2.3.4.1
digests = sha256
ess_cert_id_alg = sha256
)";

void run_openssl(const fs::path& folder, const std::string& arguments) {
  const auto done =
      Process({"/bin/sh", "-c", "cd '" + folder.string() + "' && openssl " + arguments}).wait();
  if (done.exit_code != 0) throw std::runtime_error("openssl " + arguments + ": " + done.err);
}

}  // namespace

TimeStampAuthority::TimeStampAuthority(const fs::path& folder) : folder_(folder) {
  fs::create_directories(folder_);
  if (!write_file_durably(folder_ / "tsa.cnf", config)) throw std::runtime_error("no authority");
  run_openssl(folder_,
              "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -config tsa.cnf "
              "-keyout tsa.key -out tsa.pem -days 30");
}

TimeStamper TimeStampAuthority::stamper() const {
  return [folder = folder_](const std::string& query) -> Result<std::string> {
    if (auto written = write_file_durably(folder / "query.tsq", query); !written) {
      return forward(written);
    }
    run_openssl(folder,
                "ts -reply -config tsa.cnf -queryfile query.tsq -inkey tsa.key -signer tsa.pem "
                "-out answer.tsr");
    return read_file(folder / "answer.tsr");
  };
}

}  // namespace skullstation::testing
