#include "capture/calibration/utc_text.h"

#include <chrono>
#include <string_view>

namespace skullstation {

std::optional<UtcTime> from_iso8601(const std::string& text) {
  // "0" stands for a digit.
  constexpr std::string_view shape = "0000-00-00T00:00:00";
  if (text.size() <= shape.size() || text.back() != 'Z') return std::nullopt;
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] == '0' ? !is_digit(text[i]) : text[i] != shape[i]) return std::nullopt;
  }
  const auto number = [&](std::size_t at, std::size_t digits) {
    int value = 0;
    for (std::size_t i = at; i < at + digits; ++i) value = 10 * value + (text[i] - '0');
    return value;
  };
  const std::chrono::year_month_day date(std::chrono::year(number(0, 4)),
                                         std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                         std::chrono::day(static_cast<unsigned>(number(8, 2))));
  const int hour = number(11, 2);
  const int minute = number(14, 2);
  const int second = number(17, 2);
  if (!date.ok() || hour > 23 || minute > 59 || second > 60) return std::nullopt;
  std::chrono::microseconds fraction{0};
  if (text[shape.size()] == '.') {
    std::chrono::microseconds unit{100000};
    for (std::size_t i = shape.size() + 1; i + 1 < text.size(); ++i) {
      if (!is_digit(text[i])) return std::nullopt;
      fraction += unit * (text[i] - '0');
      unit /= 10;
    }
  } else if (text.size() != shape.size() + 1) {
    return std::nullopt;
  }
  return UtcTime(std::chrono::sys_days(date)) + std::chrono::hours(hour) +
         std::chrono::minutes(minute) + std::chrono::seconds(second) + fraction;
}

}  // namespace skullstation
