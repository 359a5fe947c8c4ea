#include "daemon/delivery/curl_session.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "core/sha256.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr long connect_seconds = 20;
constexpr long stalled_seconds = 60;

/// Initialised once for the process.
CURLcode start_curl() {
  static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
  return started;
}

struct HeaderList {
  curl_slist* list = nullptr;
  HeaderList() = default;
  explicit HeaderList(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) list = curl_slist_append(list, line.c_str());
  }
  ~HeaderList() { curl_slist_free_all(list); }
  HeaderList(const HeaderList&) = delete;
  HeaderList& operator=(const HeaderList&) = delete;
};

/// What is sent, as one stream that can be wound back.
class Upload {
 public:
  explicit Upload(const CurlRequest& request) : request_(request) {
    if (request.file.empty()) return;
    in_.open(request.file, std::ios::binary);
    std::error_code error;
    file_bytes_ = fs::file_size(request.file, error);
    readable_ = in_.good() && !error;
  }
  bool readable() const { return readable_; }
  std::uint64_t bytes() const {
    return request_.before.size() + file_bytes_ + request_.after.size();
  }
  void seek(std::uint64_t place) { place_ = place; }
  /// 0 at the end; fewer bytes than there should be where the file shrank.
  std::size_t read(char* to, std::size_t space) {
    const std::uint64_t file_begin = request_.before.size();
    const std::uint64_t file_end = file_begin + file_bytes_;
    std::size_t count = 0;
    if (place_ < file_begin) {
      count = request_.before.copy(to, space, place_);
    } else if (place_ < file_end) {
      in_.clear();
      in_.seekg(static_cast<std::streamoff>(place_ - file_begin));
      const auto wanted = std::min<std::uint64_t>(space, file_end - place_);
      in_.read(to, static_cast<std::streamsize>(wanted));
      count = static_cast<std::size_t>(in_.gcount());
    } else if (place_ < bytes()) {
      count = request_.after.copy(to, space, place_ - file_end);
    }
    place_ += count;
    return count;
  }

 private:
  const CurlRequest& request_;
  std::ifstream in_;
  std::uint64_t file_bytes_ = 0;
  std::uint64_t place_ = 0;
  bool readable_ = true;
};

struct Download {
  CurlAnswer answer;
  Sha256 sum;
  std::size_t keep_bytes = 0;
};

std::size_t read_upload(char* to, std::size_t size, std::size_t count, void* upload) {
  return static_cast<Upload*>(upload)->read(to, size * count);
}

int seek_upload(void* upload, curl_off_t place, int origin) {
  if (origin != SEEK_SET) return CURL_SEEKFUNC_CANTSEEK;
  static_cast<Upload*>(upload)->seek(static_cast<std::uint64_t>(place));
  return CURL_SEEKFUNC_OK;
}

std::size_t write_download(const char* from, std::size_t size, std::size_t count, void* download) {
  auto& into = *static_cast<Download*>(download);
  const std::string_view piece(from, size * count);
  into.sum.update(piece);
  into.answer.bytes += piece.size();
  const std::size_t room = into.keep_bytes - std::min(into.keep_bytes, into.answer.body.size());
  into.answer.body += piece.substr(0, room);
  return piece.size();
}

int watch(void* progress, curl_off_t down_total, curl_off_t down, curl_off_t up_total,
          curl_off_t up) {
  const auto& told = *static_cast<const Progress*>(progress);
  const double total = static_cast<double>(down_total + up_total);
  if (total > 0.0) told.report(static_cast<double>(down + up) / total, "transferring");
  return told.stop.stop_requested() ? 1 : 0;
}

std::string host_of(const std::string& url) {
  const auto begin = url.find("://") + 3;
  return url.substr(begin, url.find('/', begin) - begin);
}

/// `detail`: libcurl's own words.
tl::unexpected<Error> curl_error(CURLcode code, const std::string& url, const std::string& detail) {
  const std::string host = host_of(url);
  const auto for_now = [&](std::string what, std::string advice = {}) {
    return fail(ErrorKind::hardware, host, std::move(what), std::move(advice));
  };
  const auto for_good = [&](std::string what, std::string advice) {
    return fail(ErrorKind::bad_input, host, std::move(what), std::move(advice));
  };
  switch (code) {
    case CURLE_ABORTED_BY_CALLBACK:
      return fail(ErrorKind::cancelled, host, "delivery was stopped on request");
    case CURLE_COULDNT_RESOLVE_HOST:
      return for_now("nobody knows this name", "check the address and this machine's network");
    case CURLE_COULDNT_CONNECT:
      return for_now("does not answer", "see whether it runs and can be reached from here");
    case CURLE_OPERATION_TIMEDOUT:
      return for_now(fmt::format("has been silent for too long ({})", detail));
    case CURLE_PEER_FAILED_VERIFICATION:
      if (url.starts_with("sftp")) {
        return for_now(fmt::format("shows another host key than the configured one ({})", detail),
                       "nothing was sent. Ask its administrator whether the key was changed, and "
                       "for the new key's fingerprint, by another way than this network");
      }
      return for_now(fmt::format("its certificate is not to be trusted ({})", detail),
                     "nothing was sent. Has it expired, is it for this name, does ca_file hold "
                     "who vouches for it?");
    case CURLE_SSL_CONNECT_ERROR:
      return for_now(fmt::format("no encrypted connection could be agreed on ({})", detail),
                     "does it accept this station's certificate (certificate_file), and is it "
                     "still valid?");
    case CURLE_SSL_CERTPROBLEM:
    case CURLE_SSL_CACERT_BADFILE:
      return for_good(
          fmt::format("this station's own certificate files can't be used ({})", detail),
          "check certificate_file, key_file and ca_file, then retry");
    case CURLE_LOGIN_DENIED:
      return for_good("refuses the login", "check user and secret or key_file, then retry");
    case CURLE_REMOTE_ACCESS_DENIED:
      return for_good(fmt::format("refuses access ({})", detail),
                      "give the user the right to write there, then retry");
    case CURLE_REMOTE_DISK_FULL:
      return for_now("the receiver's disk is full", "free some space there; it is tried again");
    default:
      return for_now(fmt::format("the connection was cut or failed ({})",
                                 detail.empty() ? curl_easy_strerror(code) : detail));
  }
}

}  // namespace

struct CurlSession::Parts {
  CURL* curl = nullptr;
  TargetConfig config;
  Secret secret;
  std::string sigv4;
  std::array<char, CURL_ERROR_SIZE> words{};

  Parts() = default;
  ~Parts() { curl_easy_cleanup(curl); }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  template <class Value>
  void set(CURLoption option, Value value) {
    curl_easy_setopt(curl, option, value);
  }
  void set_if(CURLoption option, const std::string& text) {
    if (!text.empty()) set(option, text.c_str());
  }

  void set_peer() {
    set(CURLOPT_ERRORBUFFER, words.data());
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_PROXY, "");
    set(CURLOPT_FOLLOWLOCATION, 0L);
    set(CURLOPT_PROTOCOLS_STR, config.protocol == DeliveryProtocol::sftp ? "sftp" : "https,http");
    set(CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
    set(CURLOPT_CONNECTTIMEOUT, connect_seconds);
    set(CURLOPT_LOW_SPEED_LIMIT, 1L);
    set(CURLOPT_LOW_SPEED_TIME, stalled_seconds);
    set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
    set_if(CURLOPT_CAINFO, config.ca_file);
    if (config.protocol == DeliveryProtocol::sftp) return set_sftp();
    set_if(CURLOPT_SSLCERT, config.certificate_file);
    set_if(CURLOPT_SSLKEY, config.key_file);
    set(CURLOPT_KEYPASSWD, "");  // nobody is there to be asked for a passphrase
    if (secret.empty()) return;
    if (config.protocol == DeliveryProtocol::s3) {
      set(CURLOPT_AWS_SIGV4, sigv4.c_str());
    } else if (config.user.empty()) {
      set(CURLOPT_HTTPAUTH, CURLAUTH_BEARER);
      return set(CURLOPT_XOAUTH2_BEARER, secret.reveal());
    } else {
      set(CURLOPT_HTTPAUTH, CURLAUTH_BASIC);
    }
    set(CURLOPT_USERNAME, config.user.c_str());
    set(CURLOPT_PASSWORD, secret.reveal());
  }

  void set_sftp() {
    // Without this libcurl takes any host key.
    const std::string pin = config.host_key_sha256.substr(std::string("SHA256:").size());
    set(CURLOPT_SSH_HOST_PUBLIC_KEY_SHA256, pin.c_str());
    set(CURLOPT_USERNAME, config.user.c_str());
    if (secret.empty()) {
      set(CURLOPT_SSH_AUTH_TYPES, static_cast<long>(CURLSSH_AUTH_PUBLICKEY));
      set(CURLOPT_SSH_PRIVATE_KEYFILE, config.key_file.c_str());
    } else {
      set(CURLOPT_SSH_AUTH_TYPES, static_cast<long>(CURLSSH_AUTH_PASSWORD));
      set(CURLOPT_PASSWORD, secret.reveal());
    }
    set(CURLOPT_FTP_CREATE_MISSING_DIRS, static_cast<long>(CURLFTP_CREATE_DIR_RETRY));
  }
};

CurlSession::CurlSession(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
CurlSession::~CurlSession() = default;

Result<std::unique_ptr<CurlSession>> CurlSession::open(const TargetConfig& config) {
  auto parts = std::make_unique<Parts>();
  parts->config = config;
  if (!config.secret.empty()) {
    auto secret = read_secret(config.secret);
    if (!secret) return forward(secret);
    parts->secret = *std::move(secret);
  }
  for (const std::string& file : {config.ca_file, config.certificate_file}) {
    if (!file.empty() && !std::ifstream(file)) {
      return fail(ErrorKind::bad_input, file, "can't be read; a certificate was expected");
    }
  }
  if (!config.key_file.empty()) {
    if (const auto safe = check_secret_file(config.key_file); !safe) return forward(safe);
  }
  parts->sigv4 = fmt::format("aws:amz:{}:s3", config.region);
  if (start_curl() == CURLE_OK) parts->curl = curl_easy_init();
  if (parts->curl == nullptr) return fail(ErrorKind::no_result, "libcurl", "can't be started");
  return std::unique_ptr<CurlSession>(new CurlSession(std::move(parts)));
}

Result<CurlAnswer> CurlSession::send(const CurlRequest& request, const Progress& progress) {
  Upload upload(request);
  if (!upload.readable()) {
    return fail(ErrorKind::bad_input, request.file.string(), "can't be read");
  }
  Download download;
  download.keep_bytes = request.keep_bytes;
  const HeaderList headers(request.headers);
  const HeaderList after(request.then);
  Parts& parts = *parts_;
  curl_easy_reset(parts.curl);  // keeps the connection
  parts.set_peer();
  parts.words.front() = '\0';
  parts.set(CURLOPT_URL, request.url.c_str());
  parts.set(CURLOPT_HTTPHEADER, headers.list);
  parts.set(CURLOPT_WRITEFUNCTION, write_download);
  parts.set(CURLOPT_WRITEDATA, &download);
  parts.set(CURLOPT_NOPROGRESS, 0L);
  parts.set(CURLOPT_XFERINFOFUNCTION, watch);
  parts.set(CURLOPT_XFERINFODATA, const_cast<Progress*>(&progress));
  if (upload.bytes() > 0 || request.method == "PUT") {
    parts.set(CURLOPT_UPLOAD, 1L);
    parts.set(CURLOPT_READFUNCTION, read_upload);
    parts.set(CURLOPT_READDATA, &upload);
    parts.set(CURLOPT_SEEKFUNCTION, seek_upload);
    parts.set(CURLOPT_SEEKDATA, &upload);
    parts.set(CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(upload.bytes()));
  } else if (request.method == "HEAD") {
    parts.set(CURLOPT_NOBODY, 1L);
  }
  if (parts.config.protocol == DeliveryProtocol::sftp) {
    parts.set(CURLOPT_POSTQUOTE, after.list);
    parts.set(CURLOPT_NOBODY, request.method == "NONE" ? 1L : 0L);
  } else if (request.method != "GET" && request.method != "HEAD") {
    parts.set(CURLOPT_CUSTOMREQUEST, request.method.c_str());
  }
  const CURLcode code = curl_easy_perform(parts.curl);
  file_was_missing_ = code == CURLE_REMOTE_FILE_NOT_FOUND;
  if (code != CURLE_OK) return curl_error(code, request.url, parts.words.data());
  long status = 0;
  curl_easy_getinfo(parts.curl, CURLINFO_RESPONSE_CODE, &status);
  const char* type = nullptr;
  curl_easy_getinfo(parts.curl, CURLINFO_CONTENT_TYPE, &type);
  download.answer.status = static_cast<int>(status);
  download.answer.content_type = type != nullptr ? type : "";
  download.answer.sha256 = download.sum.finish();
  return std::move(download.answer);
}

tl::unexpected<Error> status_error(const std::string& url, const CurlAnswer& answer) {
  const auto told = [&](ErrorKind kind, std::string what, std::string advice = {}) {
    return fail(kind, url, fmt::format("{} (HTTP {})", what, answer.status), std::move(advice));
  };
  switch (answer.status) {
    case 401:
    case 403:
    case 407:
      return told(ErrorKind::bad_input, "the receiver refuses access",
                  "check user, secret and certificate_file, then retry");
    case 404:
    case 409:
      return told(ErrorKind::bad_input, "the receiver has no such place",
                  "check the address, or have it made there, then retry");
    case 408:
    case 429: return told(ErrorKind::hardware, "the receiver is busy");
    case 413:
      return told(ErrorKind::bad_input, "this is too large for the receiver",
                  "have its limit raised, then retry");
    case 507:
      return told(ErrorKind::hardware, "the receiver's disk is full",
                  "free some space there; it is tried again");
    default: break;
  }
  if (answer.status == 400 && answer.body.find("certificate") != std::string::npos) {
    return told(ErrorKind::bad_input, "the receiver wants a client certificate that it knows",
                "set certificate_file and key_file, then retry");
  }
  if (answer.status >= 500) return told(ErrorKind::hardware, "the receiver has trouble of its own");
  return told(ErrorKind::bad_input, "the receiver refuses it",
              "its administrator can see the reason in its log; then retry");
}

std::string without_slash(std::string address) {
  while (address.ends_with('/')) address.pop_back();
  return address;
}

}  // namespace skullstation
