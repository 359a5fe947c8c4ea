#include "daemon/model/model_source.h"

#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "core/file.h"
#include "reconstruction/statistics/model_file.h"

// default_model.S
extern "C" const char skullstation_default_model[];
extern "C" const char skullstation_default_model_end[];

namespace skullstation {

namespace {

constexpr const char* default_name = "default model";

std::string default_model() { return {skullstation_default_model, skullstation_default_model_end}; }

/// Whatever the file's provenance tells in the form that `model build` writes.
void read_provenance(ModelSource& source) {
  const auto provenance = nlohmann::json::parse(source.model.provenance, nullptr, false);
  if (!provenance.is_object()) return;
  const auto text = [](const nlohmann::json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  source.card = text(provenance, "card");
  for (const auto& [list, key, before] :
       {std::tuple("left_out", "reason", "left out: "), {"subjects", "remark", ""}}) {
    const auto found = provenance.find(list);
    if (found == provenance.end() || !found->is_array()) continue;
    for (const auto& subject : *found) {
      if (!subject.is_object() || text(subject, key).empty()) continue;
      source.remarks.emplace_back(text(subject, "name"), before + text(subject, key));
    }
  }
}

}  // namespace

Result<ModelSource> load_model(const std::optional<std::filesystem::path>& file) {
  auto bytes = file ? read_file(*file) : Result<std::string>(default_model());
  if (!bytes) return forward(bytes);
  ModelSource source;
  source.name = file ? file->filename().string() : default_name;
  source.sha256 = sha256_hex(*bytes);
  auto model = decode_model(*std::move(bytes), file ? file->string() : default_name);
  if (!model) return forward(model);
  source.model = *std::move(model);
  read_provenance(source);
  return source;
}

Result<Templates> load_templates(const std::optional<std::filesystem::path>& file) {
  if (file) return read_templates(*file);
  auto source = load_model(std::nullopt);
  if (!source) return forward(source);
  return Templates{std::move(source->model.skull_template), std::move(source->model.head_template)};
}

}  // namespace skullstation
