#include "daemon/delivery/time_stamp_client.h"

#include <utility>

#include "daemon/delivery/curl_session.h"

namespace skullstation {

TimeStamper time_stamper_at(std::string url) {
  return [url = std::move(url)](const std::string& query) -> Result<std::string> {
    TargetConfig authority;
    authority.name = "time-stamp";
    authority.protocol = DeliveryProtocol::webdav;  // plain HTTP(S), without user and secret
    authority.address = url;
    const auto session = CurlSession::open(authority);
    if (!session) return forward(session);
    const auto answer = (*session)->send({.method = "POST",
                                          .url = url,
                                          .headers = {"Content-Type: application/timestamp-query",
                                                      "Accept: application/timestamp-reply"},
                                          .before = query});
    if (!answer) return forward(answer);
    if (answer->status != 200) return status_error(url, *answer);
    return answer->body;
  };
}

}  // namespace skullstation
