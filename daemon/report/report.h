#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/image.h"

namespace skullstation {

using CaptionedPictures = std::vector<std::pair<std::string, Image8>>;

struct Heading {
  std::string text;
};
struct Paragraph {
  std::string text;
};
/// A paragraph that stands out: its first words, then the sentence.
struct Warning {
  std::string name;
  std::string text;
};
/// Two columns: what, and its value.
struct Table {
  std::vector<std::pair<std::string, std::string>> rows;
};
/// Pictures in rows, each with its caption.
struct Pictures {
  CaptionedPictures pictures;
};
/// A row for each name: ours filled, the reference open, both with a line of one standard deviation
/// either way.
struct ErrorBars {
  struct Bar {
    double mean = 0.0;
    double sd = 0.0;
  };
  struct Row {
    std::string name;
    Bar ours;
    Bar reference;
  };
  std::vector<Row> rows;
  std::string unit;
  std::string ours;
  std::string reference;
};

using ReportBlock = std::variant<Heading, Paragraph, Warning, Table, Pictures, ErrorBars>;

/// What a report says, one block below the other, whatever it is printed as. All of it is text:
/// nothing is taken for HTML.
struct Report {
  std::string title;
  std::vector<ReportBlock> blocks;

  void add(ReportBlock block) { blocks.push_back(std::move(block)); }
};

}  // namespace skullstation
