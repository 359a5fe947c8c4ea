#include "tests/servers/receivers.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "core/file.h"

namespace skullstation::testing {

namespace fs = std::filesystem;

namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

int connected_to(int port) {
  const int s = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(port);
  if (::connect(s, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return s;
  ::close(s);
  return -1;
}

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  if (const auto done = write_file_durably(file, text); !done) {
    throw std::runtime_error(done.error().message());
  }
}

std::string run(const std::string& shell) {
  Process process({"/bin/bash", "-c", shell});
  const auto result = process.wait();
  if (result.exit_code != 0) throw std::runtime_error(shell + ": " + result.err);
  return result.out;
}

}  // namespace

std::string enter_own_network() {
  if (::geteuid() != 0) return "only root may start servers in a network of their own";
  if (::unshare(CLONE_NEWNET | CLONE_NEWNS) != 0) return "no network of its own can be had here";
  ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
  const int s = ::socket(AF_INET, SOCK_DGRAM, 0);
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  const bool up = ::ioctl(s, SIOCSIFFLAGS, &request) == 0;
  ::close(s);
  return up ? "" : "the loopback of its own network can't be set up";
}

Certificates::Certificates() {
  run(fmt::format(R"(set -e; cd {}; umask 077
key="-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes"
openssl req -x509 $key -keyout ca.key -out ca.pem -days 30 -subj "/CN=Test CA" \
  -addext basicConstraints=critical,CA:TRUE -addext keyUsage=critical,keyCertSign,cRLSign
make() {{
  openssl req -new $key -keyout $1.key -out $1.csr -subj "/CN=$2"
  openssl x509 -req -in $1.csr -CA ca.pem -CAkey ca.key -CAcreateserial $4 -out $1.pem \
    -extfile <(printf "basicConstraints=CA:FALSE\nkeyUsage=digitalSignature\nextendedKeyUsage=$3\nsubjectAltName=DNS:localhost,IP:127.0.0.1\n")
}}
make server localhost serverAuth,clientAuth "-days 30"
make expired localhost serverAuth "-days -1"
make client station-01 clientAuth "-days 30"
openssl req -x509 $key -keyout rogue.key -out rogue.pem -days 30 -subj /CN=rogue
cat ca.pem >> server.pem; cat ca.pem >> expired.pem; chmod 644 *.pem)",
                  folder_.path().string()));
  fs::permissions(folder_.path(), fs::perms(0755));
}

const Certificates& certificates() {
  static const Certificates made;
  return made;
}

Receiver::Receiver(const std::vector<std::string>& command, int port) : process_(command) {
  for (int i = 0; i < 300; ++i) {
    if (const int s = connected_to(port); s >= 0) {
      ::close(s);
      return;
    }
    if (process_.wait_for(std::chrono::milliseconds(100))) break;
  }
  const auto ended =
      process_.wait_for(std::chrono::milliseconds(1)) ? process_.wait() : ProcessResult{};
  throw std::runtime_error(command.front() + " does not listen: " + ended.err + ended.out);
}

Receiver::~Receiver() {
  process_.send(SIGTERM);
  process_.wait_for(std::chrono::seconds(5));
}

std::unique_ptr<Receiver> start_nginx(const fs::path& folder, const fs::path& root, bool expired) {
  const Certificates& c = certificates();
  fs::create_directories(folder / "nginx");
  write(folder / "nginx/conf",
        fmt::format(R"(load_module /usr/lib/nginx/modules/ngx_http_dav_ext_module.so;
user root; pid {0}/pid; error_log {0}/error.log; daemon off; worker_processes 1;
events {{ worker_connections 64; }}
http {{
 access_log {0}/access.log; client_body_temp_path {0}/1; proxy_temp_path {0}/2;
 fastcgi_temp_path {0}/3; uwsgi_temp_path {0}/4; scgi_temp_path {0}/5; client_max_body_size 2g;
 ssl_certificate {1}; ssl_certificate_key {2}; ssl_protocols TLSv1.2 TLSv1.3;
 ssl_client_certificate {3}; ssl_verify_client on;
 server {{ listen 127.0.0.1:18443 ssl; server_name localhost;
  location / {{ proxy_pass http://127.0.0.1:18042/; proxy_set_header Host $http_host;
   proxy_set_header X-Forwarded-Proto https; proxy_request_buffering off; }} }}
 server {{ listen 127.0.0.1:18444 ssl; server_name localhost; root {4};
  location / {{ dav_methods PUT DELETE MKCOL COPY MOVE; dav_ext_methods PROPFIND OPTIONS;
   dav_access user:rw group:r; }} }}
}}
)",
                    (folder / "nginx").string(), expired ? c.expired_chain() : c.server_chain(),
                    expired ? c.expired_key() : c.server_key(), c.ca(), root.string()));
  return std::make_unique<Receiver>(
      std::vector<std::string>{"/usr/sbin/nginx", "-p", folder / "nginx", "-c",
                               folder / "nginx/conf"},
      18444);
}

std::unique_ptr<Receiver> start_apache(const fs::path& folder, const fs::path& root) {
  const Certificates& c = certificates();
  std::string modules;
  for (const char* name : {"mpm_event", "authz_core", "dav", "dav_fs", "ssl"}) {
    modules += fmt::format("LoadModule {0}_module /usr/lib/apache2/modules/mod_{0}.so\n", name);
  }
  // Who may write is decided by the certificate alone; root may not run Apache's children.
  run(fmt::format("mkdir -p {1}/locks; chown -R www-data {0} {1}/locks; chmod 755 {1}",
                  root.string(), folder.string()));
  write(folder / "apache/conf", fmt::format(R"({0}ServerRoot {1}
PidFile {1}/pid
ErrorLog {1}/error.log
Listen 127.0.0.1:18445
ServerName localhost
User www-data
Group www-data
DocumentRoot {2}
DavLockDB {2}/../locks/db
SSLEngine on
SSLCertificateFile {3}
SSLCertificateKeyFile {4}
SSLCACertificateFile {5}
SSLVerifyClient require
<Directory {2}>
 Dav On
 Require all granted
</Directory>
)",
                                            modules, (folder / "apache").string(), root.string(),
                                            c.server_chain(), c.server_key(), c.ca()));
  return std::make_unique<Receiver>(
      std::vector<std::string>{"/usr/sbin/apache2", "-DFOREGROUND", "-f", folder / "apache/conf"},
      18445);
}

std::unique_ptr<Receiver> start_sshd(const fs::path& folder) {
  fs::create_directories("/run/sshd");
  run(
      fmt::format("cd {}; ssh-keygen -q -t ed25519 -N '' -f host; ssh-keygen -q -t ed25519 -N '' "
                  "-f id; cp id.pub authorized",
                  folder.string()));
  write(folder / "sshd.conf", fmt::format(R"(ListenAddress 127.0.0.1
Port 12222
HostKey {0}/host
PidFile none
AuthorizedKeysFile {0}/authorized
StrictModes no
PermitRootLogin prohibit-password
PasswordAuthentication no
KbdInteractiveAuthentication no
UsePAM no
Subsystem sftp internal-sftp
)",
                                          folder.string()));
  return std::make_unique<Receiver>(
      std::vector<std::string>{"/usr/sbin/sshd", "-D", "-e", "-f", folder / "sshd.conf"}, 12222);
}

std::string fingerprint_of(const fs::path& public_key) {
  const std::string line = run("ssh-keygen -lf " + public_key.string());
  const auto begin = line.find("SHA256:");
  return line.substr(begin, line.find(' ', begin) - begin);
}

std::unique_ptr<Receiver> start_orthanc(const fs::path& folder, bool tls) {
  const Certificates& c = certificates();
  write(folder / "orthanc.json", fmt::format(R"({{
 "Name":"CASEPACS","StorageDirectory":"{0}/db","IndexDirectory":"{0}/db",
 "HttpPort":18042,"DicomPort":14242,"DicomAet":"CASEPACS","RemoteAccessAllowed":false,
 "AuthenticationEnabled":false,"DicomCheckCalledAet":true,
 "DicomAlwaysAllowEcho":true,"DicomAlwaysAllowStore":false,"DicomAlwaysAllowGet":false,
 "DicomModalities":{{"station":{{"AET":"STATION01","Host":"127.0.0.1","Port":14243,
  "AllowEcho":true,"AllowStore":true,"AllowGet":true,"AllowFind":true}}}},
 "StorageCompression":false,"OverwriteInstances":false,
 "DicomTlsEnabled":{1},"DicomTlsCertificate":"{2}","DicomTlsPrivateKey":"{3}",
 "DicomTlsTrustedCertificates":"{4}",
 "Plugins":["/usr/share/orthanc/plugins/libOrthancDicomWeb.so"],
 "DicomWeb":{{"Enable":true,"Root":"/dicom-web/","EnableWado":true,"Ssl":false}}}})",
                                             folder.string(), tls ? "true" : "false",
                                             c.server_chain(), c.server_key(), c.ca()));
  auto orthanc = std::make_unique<Receiver>(
      std::vector<std::string>{"/usr/sbin/Orthanc", folder / "orthanc.json"}, 14242);
  for (int i = 0; i < 100; ++i) {
    if (const int s = connected_to(18042); s >= 0) {
      ::close(s);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return orthanc;
}

namespace {

std::unique_ptr<Receiver> start_double(const char* script, const fs::path& folder,
                                       const std::string& secret, int port) {
  return std::make_unique<Receiver>(
      std::vector<std::string>{"/usr/bin/python3",
                               fs::path(SKULLSTATION_SOURCE_DIR) / "tests/servers" / script,
                               std::to_string(port), folder, secret},
      port);
}

}  // namespace

std::unique_ptr<Receiver> start_s3(const fs::path& folder, const std::string& secret) {
  return start_double("s3_double.py", folder, secret, 19000);
}

std::unique_ptr<Receiver> start_fhir(const fs::path& folder, const std::string& token) {
  return start_double("fhir_double.py", folder, token, 19001);
}

CuttingProxy::CuttingProxy(int from, int to, std::size_t bytes) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const sockaddr_in address = loopback(from);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener, 8) != 0) {
    throw std::runtime_error("no proxy");
  }
  child_ = ::fork();
  if (child_ != 0) {
    ::close(listener);
    return;
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGPIPE, SIG_IGN);
  std::array<char, 16384> buffer{};
  std::size_t left = bytes;
  for (;;) {
    const int client = ::accept(listener, nullptr, nullptr);
    const int server = connected_to(to);
    for (bool open = true; open && left > 0;) {
      std::array<pollfd, 2> ends{{{client, POLLIN, 0}, {server, POLLIN, 0}}};
      ::poll(ends.data(), ends.size(), -1);
      if (ends[0].revents != 0) {
        const ssize_t got = ::read(client, buffer.data(), std::min(buffer.size(), left));
        open = got > 0 && ::write(server, buffer.data(), static_cast<std::size_t>(got)) == got;
        if (got > 0) left -= static_cast<std::size_t>(got);
      }
      if (open && ends[1].revents != 0) {
        const ssize_t got = ::read(server, buffer.data(), buffer.size());
        open = got > 0 && ::write(client, buffer.data(), static_cast<std::size_t>(got)) == got;
      }
    }
    ::close(client);
    ::close(server);
  }
}

CuttingProxy::~CuttingProxy() {
  ::kill(child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
}

}  // namespace skullstation::testing
