#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/board_pattern.h"
#include "core/session/charuco_board.h"
#include "daemon/cli/commands.h"
#include "daemon/station/station_config.h"

namespace skullstation {

namespace {

std::string rectangle(double x_mm, double y_mm, double width_mm, double height_mm) {
  return fmt::format("M{:.6g} {:.6g}h{:.6g}v{:.6g}h{:.6g}z", x_mm, y_mm, width_mm, height_mm,
                     -width_mm);
}

/// The board as vectors in mm: printed at 100 % it has its true size on any printer.
std::string board_svg(const CharucoBoard& board) {
  std::string black;
  for (int row = 0; row < board.squares_y; ++row) {
    for (int column = 0; column < board.squares_x; ++column) {
      if ((row + column) % 2 != 0) continue;
      black += rectangle(column * board.square_mm, row * board.square_mm, board.square_mm,
                         board.square_mm);
    }
  }
  std::string white;
  const MarkerDictionary dictionary = *marker_dictionary(board.dictionary);
  const double cell_mm = board.marker_mm / (dictionary.bits + 2);
  const double margin_mm = 0.5 * (board.square_mm - board.marker_mm);
  for (const BoardMarker& marker : board_markers(board)) {
    const double x_mm = marker.column * board.square_mm + margin_mm;
    const double y_mm = marker.row * board.square_mm + margin_mm;
    black += rectangle(x_mm, y_mm, board.marker_mm, board.marker_mm);
    const Image8 bits = marker_bits(dictionary, marker.id);
    for (int y = 0; y < bits.height; ++y) {
      for (int x = 0; x < bits.width; ++x) {
        if (bits.at(x, y) == 0) continue;
        white += rectangle(x_mm + (x + 1) * cell_mm, y_mm + (y + 1) * cell_mm, cell_mm, cell_mm);
      }
    }
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" "
      "viewBox=\"0 0 {0} {1}\" shape-rendering=\"crispEdges\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n<path d=\"{2}\"/>\n"
      "<path fill=\"white\" d=\"{3}\"/>\n</svg>\n",
      board.width_mm(), board.height_mm(), black, white);
}

}  // namespace

Result<CommandReport> run(const BoardCommand& command, const CommonOptions&, const Progress&) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  const CharucoBoard& board = config->board;
  if (const auto written = write_file_durably(command.out, board_svg(board)); !written) {
    return forward(written);
  }
  const nlohmann::ordered_json json = {{"board", command.out.string()},
                                       {"width_mm", board.width_mm()},
                                       {"height_mm", board.height_mm()},
                                       {"square_mm", board.square_mm}};
  return CommandReport{
      fmt::format("{}: {:g} x {:g} mm. Print it at 100 %, glue it to a flat plate, measure the "
                  "print and put the true edge of a square ({:g} mm?) into station.toml: "
                  "board.square_mm sets the scale of everything.",
                  command.out.string(), board.width_mm(), board.height_mm(), board.square_mm),
      json.dump(2)};
}

}  // namespace skullstation
