#include "daemon/http/console.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>

#include "daemon/web/web_assets.h"

namespace skullstation {

namespace {

constexpr std::string_view api = "/api/v1";

bool is_safe(const std::string& method) { return method == "GET"; }

/// Did a page of this console send it? Browsers say where a request comes from; other programs have
/// to say it, too.
bool is_from_here(const Request& request) {
  const std::string site = request.header("sec-fetch-site");
  if (!site.empty() && site != "same-origin") return false;
  const std::string origin = request.header("origin");
  if (origin.empty()) return !site.empty();
  return origin == "https://" + request.header("host");
}

bool is_equal_in_any_time(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  }
  return difference == 0;
}

/// The body as a JSON object, or why it is none.
std::optional<Response> take_body(const Route& route, Call& call) {
  if (!route.has_body) {
    if (call.request.body.empty()) return std::nullopt;
    return refusal(400, "bad_request", "this request has no body");
  }
  const std::string type = call.request.header("content-type");
  if (type.substr(0, type.find(';')) != "application/json") {
    return refusal(415, "content_type", "the body must be application/json");
  }
  auto json = parse_strict_json(call.request.body, "the request's body");
  if (!json) return refusal(400, "bad_json", json.error().message());
  if (!json->is_object()) return refusal(400, "bad_json", "the body must be a JSON object");
  call.body = *std::move(json);
  return std::nullopt;
}

/// Who asks; or why he may not.
std::optional<Response> admit(Console& console, const Route& route, Call& call) {
  const bool unsafe = !is_safe(call.request.method);
  if (unsafe && !is_from_here(call.request)) {
    return refusal(403, "origin", "the request does not come from a page of this console");
  }
  if (route.roles == everybody) return std::nullopt;
  call.token = cookie_of(call.request, session_cookie);
  const auto found = console.accounts.signed_in(call.token);
  if (!found) return refusal(found.error());
  if (!*found) return refusal(401, "signed_out", "sign in first");
  call.who = **found;
  if (unsafe && !is_equal_in_any_time(call.request.header("x-csrf-token"), call.who.csrf)) {
    return refusal(403, "csrf", "the request lacks this session's token (X-CSRF-Token)");
  }
  if ((route.roles & bit(call.who.role)) == 0) {
    return refusal(403, "role",
                   fmt::format("this is not for the role {}", to_string(call.who.role)));
  }
  return std::nullopt;
}

/// What was done is done; that it could not be written down must be seen.
Response noted(Console& console, const Route& route, const Call& call, Response response) {
  if (route.audit.empty()) return response;
  // Strangers must not fill the log: of what they try, refused guesses are enough.
  const bool of_note = response.status < 300 || response.status == 401 || response.status == 403;
  if (route.roles == everybody && !of_note) return response;
  auto details = call.details;
  details["status"] = response.status;
  details["address"] = call.request.peer;
  const std::string who = call.who.account.empty() ? "console" : call.who.account;
  const auto written =
      console.audit.note(who, "console: " + std::string(route.audit), call.subject, details);
  if (written) return response;
  return refusal(500, "not_audited",
                 fmt::format("\"{}\" was answered with {}, but the audit log can't be written: {}",
                             route.audit, response.status, written.error().message()));
}

Response answer_route(Console& console, const Route& route, Call& call) {
  if (auto refused = admit(console, route, call)) return *std::move(refused);
  if (auto refused = take_body(route, call)) return *std::move(refused);
  return noted(console, route, call, route.action(console, call));
}

Response answer_api(Console& console, const Request& request) {
  const std::string_view path = std::string_view(request.path).substr(api.size());
  std::vector<std::string_view> methods;
  for (const Route& route : api_routes()) {
    auto parts = match_route(route.path, path);
    if (!parts) continue;
    if (route.method != request.method) {
      methods.push_back(route.method);
      continue;
    }
    const auto none = console.accounts.none();
    if (!none) return refusal(none.error());
    if (*none && path != "/setup") {
      return refusal(403, "setup_needed", "this station has to be set up first");
    }
    Call call{request, *std::move(parts), {}, {}};
    return answer_route(console, route, call);
  }
  if (methods.empty()) return refusal(404, "not_found", "there is nothing here");
  Response refused = refusal(405, "method", "this can't be done here");
  refused.headers.emplace_back("Allow", fmt::format("{}", fmt::join(methods, ", ")));
  return refused;
}

Response answer_page(const Request& request) {
  if (!is_safe(request.method)) return refusal(405, "method", "pages can only be read");
  const WebAsset* asset = find_web_asset(request.path);
  if (asset == nullptr) return refusal(404, "not_found", "there is nothing here");
  const bool small = request.header("accept-encoding").find("gzip") != std::string::npos;
  Response page;
  const std::string tag = fmt::format("\"{}{}\"", asset->sha256, small ? "-gzip" : "");
  page.headers = {
      {"Content-Type", std::string(asset->content_type)},
      {"ETag", tag},
      {"Vary", "Accept-Encoding"},
      // Looked for again at every start: after an update nobody sees the old pages.
      {"Cache-Control", "no-cache"},
      {"Content-Security-Policy",
       "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: "
       "data:; connect-src 'self' blob:; frame-src 'self'; base-uri 'none'; form-action "
       "'none'; frame-ancestors 'none'; require-trusted-types-for 'script'"}};
  if (request.header("if-none-match") == tag) {
    page.status = 304;
    return page;
  }
  if (small) page.headers.emplace_back("Content-Encoding", "gzip");
  page.body = small ? asset->gzip : std::string(asset->bytes);
  return page;
}

}  // namespace

std::int64_t Call::number(const std::string& part) const {
  const std::string& text = parts.at(part);
  std::int64_t value = -1;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  return end.ec == std::errc{} && end.ptr == text.data() + text.size() ? value : -1;
}

std::optional<Response> Call::faulty() const {
  if (!faults.first()) return std::nullopt;
  return refusal(*faults.first());
}

Response answer_request(Console& console, const Request& request) {
  if (request.path == api || request.path.starts_with(std::string(api) + "/")) {
    return answer_api(console, request);
  }
  return answer_page(request);
}

}  // namespace skullstation
