// DICOMweb: STOW-RS to hand over, WADO-RS to read back (PS3.18).

#include <fmt/format.h>

#include "daemon/delivery/curl_session.h"
#include "daemon/delivery/dicom_dataset.h"
#include "daemon/delivery/target.h"

namespace skullstation {

namespace {

/// The most of an instance that is held in memory while it is compared.
constexpr std::size_t most_bytes = std::size_t{1} << 30;
constexpr const char* part_type = "Content-Type: application/dicom\r\n\r\n";

/// The only part of a multipart answer; nothing if it isn't one.
std::optional<std::string_view> only_part(std::string_view body, const std::string& content_type) {
  const auto at = content_type.find("boundary=");
  if (at == std::string::npos) return std::nullopt;
  std::string boundary = content_type.substr(at + std::string("boundary=").size());
  boundary = boundary.substr(0, boundary.find(';'));
  std::erase(boundary, '"');
  const auto begin = body.find("--" + boundary);
  const auto headers_end = body.find("\r\n\r\n", begin);
  const auto end = body.rfind("\r\n--" + boundary);
  if (begin == std::string_view::npos || headers_end == std::string_view::npos ||
      end == std::string_view::npos || end < headers_end + 4) {
    return std::nullopt;
  }
  return body.substr(headers_end + 4, end - headers_end - 4);
}

class StowTarget final : public Target {
 public:
  StowTarget(std::string address, std::unique_ptr<CurlSession> session)
      : address_(std::move(address)), session_(std::move(session)) {}

  Result<void> put(const DeliveryObject& object, const Progress& progress) override {
    const std::string boundary = "skullstation-" + object.sha256.substr(0, 32);
    const std::string url = address_ + "/studies";
    const auto answer = session_->send(
        {.method = "POST",
         .url = url,
         .headers = {fmt::format("Content-Type: multipart/related; type=\"application/dicom\"; "
                                 "boundary={}",
                                 boundary),
                     "Accept: application/dicom+json"},
         .before = fmt::format("--{}\r\n{}", boundary, part_type),
         .file = object.file,
         .after = fmt::format("\r\n--{}--\r\n", boundary)},
        progress);
    if (!answer) return forward(answer);
    // 202: with warnings. 409: none was stored; if that is since it is there, read_back() shows it.
    if (answer->status == 200 || answer->status == 202) return {};
    if (answer->status == 409) {
      return fail(ErrorKind::bad_input, url, "the receiver stored nothing of it (HTTP 409)",
                  "its administrator can see the reason in its log; then retry");
    }
    return status_error(url, *answer);
  }

  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress& progress) override {
    const auto sent = read_dicom_instance(object.file);
    if (!sent) return forward(sent);
    const std::string url = fmt::format("{}/studies/{}/series/{}/instances/{}", address_,
                                        sent->study_uid, sent->series_uid, sent->instance_uid);
    const auto answer = session_->send(
        {.url = url,
         .headers = {"Accept: multipart/related; type=\"application/dicom\"; transfer-syntax=*"},
         .keep_bytes = most_bytes},
        progress);
    if (!answer) return forward(answer);
    if (answer->status == 404) return std::optional<std::string>();
    if (answer->status != 200) return status_error(url, *answer);
    const auto part = only_part(answer->body, answer->content_type);
    if (!part) {
      return fail(ErrorKind::bad_input, url,
                  "gives back no multipart answer with the instance in it, as WADO-RS should");
    }
    const auto back = parse_dicom_instance(*part, url);
    if (!back) return forward(back);
    return std::optional(back->dataset_sha256);
  }

  Result<bool> remove(const DeliveryObject&) override { return false; }

 private:
  std::string address_;
  std::unique_ptr<CurlSession> session_;
};

}  // namespace

Result<std::unique_ptr<Target>> open_stow_target(const TargetConfig& config) {
  auto session = CurlSession::open(config);
  if (!session) return forward(session);
  return std::make_unique<StowTarget>(without_slash(config.address), *std::move(session));
}

}  // namespace skullstation
