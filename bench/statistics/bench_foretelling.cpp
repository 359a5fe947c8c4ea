// Ways to foretell a head and its soft tissue from the skull, each subject from all others: a
// Markdown table (docs/models.md). Usage:
//   bench_foretelling SUBJECTS TEMPLATES FITS
// as `skullstation model build` has them. What a method leaves open (penalties, components,
// kernels) is chosen within each fold, by leaving one of its subjects out in turn.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <vector>

#include "daemon/model/fitted_subjects.h"
#include "daemon/model/model_source.h"
#include "reconstruction/statistics/head_from_skull.h"
#include "reconstruction/statistics/leave_one_out.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What a method learns from, a subject a row: inputs are standardised, outputs have no mean and
/// are weighted with what they move (head [mm], then tissue).
struct Fold {
  MatrixXd inputs;
  MatrixXd outputs;
  VectorXd asked;  ///< the left-out subject's inputs
};
using Method = std::function<VectorXd(const Fold&)>;

VectorXd mean_of_all(const Fold& fold) { return VectorXd::Zero(fold.outputs.cols()); }

/// Kernel ridge regression and its errors left one out in closed form.
struct KernelRidge {
  MatrixXd dual;  ///< (K + noise)^-1 Y
  double error = 0.0;

  KernelRidge(const MatrixXd& kernel, double noise, const MatrixXd& outputs) {
    const Index count = kernel.rows();
    const MatrixXd inverse = Eigen::LLT<MatrixXd>(kernel + noise * MatrixXd::Identity(count, count))
                                 .solve(MatrixXd::Identity(count, count));
    dual = inverse * outputs;
    error = (inverse.diagonal().cwiseInverse().asDiagonal() * dual).squaredNorm();
  }
};

/// One penalty for all: what a joint Gaussian does whose correlations are all shrunk alike.
VectorXd ridge(const Fold& fold) {
  const MatrixXd kernel = fold.inputs * fold.inputs.transpose();
  double least = std::numeric_limits<double>::infinity();
  VectorXd result;
  for (const double noise : {1.0, 3.0, 6.0, 10.0, 20.0, 40.0, 80.0, 200.0, 1000.0}) {
    const KernelRidge fit(kernel, noise, fold.outputs);
    if (fit.error >= least) continue;
    least = fit.error;
    result = fit.dual.transpose() * (fold.inputs * fold.asked);
  }
  return result;
}

/// A Gaussian process whose kernel is linear plus squared exponential.
VectorXd gaussian_process(const Fold& fold) {
  const MatrixXd linear = fold.inputs * fold.inputs.transpose();
  const VectorXd squares = linear.diagonal();
  const auto dimensions = static_cast<double>(fold.inputs.cols());
  double least = std::numeric_limits<double>::infinity();
  VectorXd result;
  for (const double length : {1.0, 2.0, 4.0}) {
    const double scale = 0.5 / (length * length * dimensions);
    const auto bent = [&](double distance2) {
      return dimensions * std::exp(-scale * std::max(0.0, distance2));
    };
    MatrixXd exponential(linear.rows(), linear.cols());
    VectorXd asked(linear.rows());
    for (Index i = 0; i < linear.rows(); ++i) {
      for (Index j = 0; j < linear.cols(); ++j) {
        exponential(i, j) = bent(squares[i] + squares[j] - 2.0 * linear(i, j));
      }
      asked[i] = bent((fold.inputs.row(i).transpose() - fold.asked).squaredNorm());
    }
    for (const double share : {0.1, 0.5, 0.9}) {
      const MatrixXd kernel = (1.0 - share) * linear + share * exponential;
      const VectorXd towards = (1.0 - share) * fold.inputs * fold.asked + share * asked;
      for (const double noise : {1.0, 3.0, 10.0, 30.0, 100.0}) {
        const KernelRidge fit(kernel, noise, fold.outputs);
        if (fit.error >= least) continue;
        least = fit.error;
        result = fit.dual.transpose() * towards;
      }
    }
  }
  return result;
}

/// Partial least squares (SIMPLS-like deflation): what 1, 2, ... components foretell, a column
/// each.
MatrixXd least_squares_path(MatrixXd inputs, MatrixXd outputs, VectorXd asked, int components) {
  MatrixXd path(outputs.cols(), components);
  VectorXd result = VectorXd::Zero(outputs.cols());
  for (int c = 0; c < components; ++c) {
    const MatrixXd across = inputs.transpose() * outputs;
    const VectorXd way =
        Eigen::BDCSVD<MatrixXd>(across, Eigen::ComputeThinU | Eigen::ComputeThinV).matrixU().col(0);
    const VectorXd scores = inputs * way;
    const double norm = scores.squaredNorm();
    if (norm > 1e-12) {
      const VectorXd loads = inputs.transpose() * scores / norm;
      const VectorXd slope = outputs.transpose() * scores / norm;
      const double score = asked.dot(way);
      result += score * slope;
      asked -= score * loads;
      inputs -= scores * loads.transpose();
      outputs -= scores * slope.transpose();
    }
    path.col(c) = result;
  }
  return path;
}

VectorXd partial_least_squares(const Fold& fold) {
  const int components = static_cast<int>(std::min<Index>(16, fold.inputs.cols()));
  VectorXd errors = VectorXd::Zero(components);
  const Index count = fold.inputs.rows();
  for (Index n = 0; n < count; ++n) {
    MatrixXd inputs(count - 1, fold.inputs.cols());
    MatrixXd outputs(count - 1, fold.outputs.cols());
    inputs << fold.inputs.topRows(n), fold.inputs.bottomRows(count - 1 - n);
    outputs << fold.outputs.topRows(n), fold.outputs.bottomRows(count - 1 - n);
    const MatrixXd path =
        least_squares_path(inputs, outputs, fold.inputs.row(n).transpose(), components);
    errors += (path.colwise() - VectorXd(fold.outputs.row(n).transpose()))
                  .colwise()
                  .squaredNorm()
                  .transpose();
  }
  Index best = 0;
  errors.minCoeff(&best);
  return least_squares_path(fold.inputs, fold.outputs, fold.asked, components).col(best);
}

VectorXd standardised_facts(const ModelSubject& subject) {
  const PersonFacts& facts = subject.facts;
  return VectorXd{{2.0 * (facts.male.value_or(0.5) - 0.5),
                   (facts.age_years.value_or(50.0) - 50.0) / 18.0,
                   (facts.body_mass_index.value_or(26.0) - 26.0) / 4.5}};
}

struct Row {
  std::string name;
  VectorXd face_mm;   ///< a subject each
  VectorXd depth_mm;  ///< likewise
};

/// Models of all subjects but one, and what is to be compared with it.
struct LeftOutModels {
  ShapeModel skull;
  ShapeModel head;
  std::vector<Points3> skulls;  ///< of the others
  std::vector<Points3> heads;
  std::vector<ModelSubject> others;
};

Result<LeftOutModels> models_without(const SkullTemplate& skull, const HeadTemplate& head,
                                     const std::vector<ModelSubject>& subjects, std::size_t n) {
  LeftOutModels models;
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    if (i == n) continue;
    models.others.push_back(subjects[i]);
    models.skulls.push_back(subjects[i].skull.topRows(skull.boundary_count));
    models.heads.push_back(subjects[i].head);
  }
  auto of_skull = build_shape_model(models.skulls, skull_weights(skull).head(skull.boundary_count));
  if (!of_skull) return forward(of_skull);
  models.skull = *std::move(of_skull);
  auto of_head =
      build_shape_model(models.heads, vertex_areas({head.vertices, head.triangles, {}, {}}));
  if (!of_head) return forward(of_head);
  models.head = *std::move(of_head);
  return models;
}

Result<void> run(const std::filesystem::path& subject_folder,
                 const std::filesystem::path& template_file, const std::filesystem::path& fits) {
  const auto templates = load_templates(template_file);
  if (!templates) return forward(templates);
  const auto fitted =
      fit_subjects(subject_folder, templates->skull, templates->head, {fits, 1, 0}, {});
  if (!fitted) return forward(fitted);
  std::vector<ModelSubject> unaligned;
  for (const SubjectFit& fit : *fitted) {
    if (fit.failure.empty()) unaligned.push_back(fit.subject);
  }
  auto subjects = aligned_population(templates->skull, templates->head, std::move(unaligned));
  if (!subjects) return forward(subjects);
  complete_skulls(templates->skull, *subjects);
  const auto tissue = population_tissue_model(templates->skull, *subjects);
  if (!tissue) return forward(tissue);
  // Millimetres, root mean square, at the mean depth.
  const VectorXd usual = tissue_at(*tissue, VectorXd::Zero(tissue->mode_count()));
  const MatrixXd moves = usual.array().isNaN().select(0.0, usual).asDiagonal() * tissue->modes;
  const VectorXd tissue_weights =
      moves.colwise().norm().transpose() /
      std::sqrt(static_cast<double>(usual.size() - usual.array().isNaN().count()));

  const auto count = static_cast<Index>(subjects->size());
  std::vector<Row> rows;
  const auto add = [&](std::string name) {
    rows.push_back({std::move(name), VectorXd(count), VectorXd(count)});
  };
  const std::pair<const char*, Method> methods[] = {
      {"mean head, mean depths", mean_of_all},
      {"one ridge (a Gaussian, all correlations shrunk alike)", ridge},
      {"partial least squares", partial_least_squares},
      {"Gaussian process, linear + squared exponential", gaussian_process}};
  for (const char* known : {"skull", "skull, sex, age, BMI"}) {
    for (const auto& [name, method] : methods) add(fmt::format("{} | {}", known, name));
    add(fmt::format("{} | chain: skull, facts, tissue, head (the default)", known));
  }
  for (Index n = 0; n < count; ++n) {
    const ModelSubject& subject = (*subjects)[static_cast<std::size_t>(n)];
    const auto models =
        models_without(templates->skull, templates->head, *subjects, static_cast<std::size_t>(n));
    if (!models) return forward(models);
    const Index skull_modes = models->skull.mode_count();
    const Index head_modes = models->head.mode_count();
    const VectorXd head_weights = models->head.variances.cwiseSqrt() /
                                  std::sqrt(static_cast<double>(models->head.vertex_count()));
    MatrixXd inputs(count - 1, skull_modes + 3);
    MatrixXd outputs(count - 1, head_modes + tissue->mode_count());
    for (std::size_t i = 0; i < models->others.size(); ++i) {
      const auto row = static_cast<Index>(i);
      inputs.row(row) << coefficients_of(models->skull, models->skulls[i]).transpose(),
          standardised_facts(models->others[i]).transpose();
      outputs.row(row)
          << coefficients_of(models->head, models->heads[i]).cwiseProduct(head_weights).transpose(),
          tissue_belief(*tissue, models->others[i].tissue_mm)
              .mean.cwiseProduct(tissue_weights)
              .transpose();
    }
    const Eigen::RowVectorXd input_mean = inputs.colwise().mean();
    const Eigen::RowVectorXd output_mean = outputs.colwise().mean();
    const VectorXd coefficients =
        coefficients_of(models->skull, subject.skull.topRows(templates->skull.boundary_count));
    VectorXd asked(skull_modes + 3);
    asked << coefficients, standardised_facts(subject);

    const Points3 normals = vertex_normals({subject.head, templates->head.triangles, {}, {}});
    std::size_t row = 0;
    const auto note = [&](const VectorXd& head, const VectorXd& depths) {
      const Points3 shape = shape_at(models->head, head);
      rows[row].face_mm[n] = mean_facial_error_mm(
          templates->head, (shape - subject.head).cwiseProduct(normals).rowwise().sum());
      rows[row].depth_mm[n] =
          mean_depth_error_mm(*tissue, tissue_at(*tissue, depths), subject.tissue_mm);
      ++row;
    };
    const auto joint = joint_of(models->skull, models->skulls, models->head, models->heads, *tissue,
                                models->others, {});
    if (!joint) return forward(joint);
    for (const bool facts : {false, true}) {
      const Index used = skull_modes + (facts ? 3 : 0);
      const Fold fold{(inputs.rowwise() - input_mean).leftCols(used),
                      outputs.rowwise() - output_mean, (asked - input_mean.transpose()).head(used)};
      for (const auto& [name, method] : methods) {
        const VectorXd foretold = method(fold) + output_mean.transpose();
        note(foretold.head(head_modes).cwiseQuotient(head_weights),
             foretold.tail(tissue->mode_count()).cwiseQuotient(tissue_weights));
      }
      const Belief all = foretold(*joint, {coefficients, MatrixXd::Zero(skull_modes, skull_modes)},
                                  facts ? subject.facts : PersonFacts{});
      note(belief_about(*joint, all, coefficient_names("head", head_modes)).mean,
           belief_about(*joint, all, coefficient_names("tissue", tissue->mode_count())).mean);
    }
  }
  fmt::print("{} subjects, each foretold by the others\n\n", count);
  fmt::print("| known | method | face mean mm | +- | depths mm |\n|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    const double mean = row.face_mm.mean();
    const double error =
        std::sqrt((row.face_mm.array() - mean).square().sum()) / static_cast<double>(count);
    fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} |\n", row.name, mean, error, row.depth_mm.mean());
  }
  return {};
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  std::filesystem::path subjects, templates, fits;
  CLI::App app("Ways to foretell a head from a skull");
  app.add_option("subjects", subjects, "folder of subjects")->required();
  app.add_option("templates", templates, "template file")->required();
  app.add_option("fits", fits, "folder of finished fits")->required();
  CLI11_PARSE(app, argc, argv);
  if (const auto done = skullstation::run(subjects, templates, fits); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
