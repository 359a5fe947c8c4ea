#include "reconstruction/phantom/craniometric_table.h"

#include <array>

namespace skullstation {

namespace {

// Means and standard deviations by sex of 2,486 skulls of 30 populations, measured by W. W. Howells
// (Cranial Variation in Man, 1973; Skull Shapes and the Map, 1989), computed from his published
// data set. Those of the mandible: bigonial and bicondylar breadth after Voljevica and Talovic,
// Folia Medica (Sarajevo), 80 mandibles of Bosnia and Herzegovina; the mandible's heights, the
// bimental and the minimum frontal breadth are our own assumption of what is usual. code, name,
// from, to, subtense of, male mean and SD, female mean and SD [mm]
constexpr Craniometric kMeasures[] = {
    {"GOL", "glabello-occipital length", "glabella", "opisthocranion", "", 183.18, 7.53, 174.48,
     7.15},
    {"NOL", "nasio-occipital length", "nasion", "opisthocranion", "", 180.40, 7.09, 172.73, 6.79},
    {"BNL", "basion-nasion length", "basion", "nasion", "", 101.55, 5.38, 96.28, 4.93},
    {"BBH", "basion-bregma height", "basion", "bregma", "", 134.60, 6.77, 128.24, 6.19},
    {"XCB", "maximum cranial breadth", "euryon left", "euryon right", "", 139.14, 7.07, 134.25,
     6.58},
    {"XFB", "maximum frontal breadth", "coronale left", "coronale right", "", 115.40, 6.06, 111.10,
     5.92},
    {"ZYB", "bizygomatic breadth", "zygion left", "zygion right", "", 135.16, 6.45, 125.68, 5.79},
    {"AUB", "biauricular breadth", "auriculare left", "auriculare right", "", 123.71, 6.75, 117.07,
     6.34},
    {"ASB", "biasterionic breadth", "asterion left", "asterion right", "", 108.89, 5.35, 104.52,
     5.13},
    {"BPL", "basion-prosthion length", "basion", "prosthion", "", 99.75, 6.23, 95.48, 5.76},
    {"NPH", "nasion-prosthion height", "nasion", "prosthion", "", 68.04, 5.16, 63.57, 4.93},
    {"NLH", "nasal height", "nasion", "nasospinale", "", 51.51, 3.76, 48.27, 3.52},
    {"JUB", "bijugal breadth", "jugale left", "jugale right", "", 118.56, 5.31, 111.20, 4.63},
    {"NLB", "nasal breadth", "alare left", "alare right", "", 26.82, 2.32, 25.67, 2.18},
    {"MAB", "palate breadth", "supra-M2 left", "supra-M2 right", "", 65.30, 3.74, 61.51, 3.33},
    {"MDH", "mastoid height", "porion left", "mastoidale left", "", 29.30, 3.36, 25.08, 3.11},
    {"OBH", "orbit height", "mid-supraorbitale left", "orbitale left", "", 33.93, 2.28, 33.37,
     2.13},
    {"OBB", "orbit breadth", "dacryon left", "ectoconchion left", "", 40.17, 1.93, 38.69, 1.83},
    {"DKB", "interorbital breadth", "dacryon left", "dacryon right", "", 21.88, 2.33, 20.74, 2.34},
    {"WNB", "simotic chord", "nasal root left", "nasal root right", "", 8.30, 2.21, 8.29, 2.15},
    {"ZMB", "bimaxillary breadth", "zygomaxillare left", "zygomaxillare right", "", 97.57, 5.32,
     91.89, 4.59},
    {"FMB", "bifrontal breadth", "frontomalare anterior left", "frontomalare anterior right", "",
     99.05, 3.96, 94.51, 3.75},
    {"EKB", "biorbital breadth", "ectoconchion left", "ectoconchion right", "", 99.18, 3.87, 95.17,
     3.59},
    {"FRC", "frontal chord", "nasion", "bregma", "", 111.72, 5.02, 106.98, 4.83},
    {"PAC", "parietal chord", "bregma", "lambda", "", 112.78, 6.15, 107.94, 6.26},
    {"OCC", "occipital chord", "lambda", "opisthion", "", 96.91, 6.05, 94.29, 5.53},
    {"FOL", "foramen magnum length", "basion", "opisthion", "", 36.61, 2.54, 34.82, 2.42},
    {"STB", "bistephanic breadth", "stephanion left", "stephanion right", "", 110.74, 8.01, 107.74,
     7.33},
    {"FRS", "frontal subtense", "nasion", "bregma", "frontal apex", 25.41, 3.05, 25.40, 2.77},
    {"PAS", "parietal subtense", "bregma", "lambda", "parietal apex", 24.08, 2.87, 22.96, 2.80},
    {"OCS", "occipital subtense", "lambda", "opisthion", "occipital apex", 28.32, 3.62, 27.37,
     3.52},
    {"BGB", "bigonial breadth", "gonion left", "gonion right", "", 95.7, 5.19, 88.7, 6.78},
    {"CDB", "bicondylar breadth", "condylion laterale left", "condylion laterale right", "", 112.7,
     5.57, 107.5, 7.68},
    {"RAH", "ramus height", "condylion superius left", "gonion left", "", 61.0, 4.5, 55.0, 4.3},
    {"GNI", "chin height", "infradentale", "gnathion", "", 31.0, 3.0, 28.0, 2.8},
    {"HMF", "body height of the mandible", "lateral infradentale left",
     "lateral mandibular border left", "", 29.0, 2.8, 26.5, 2.6},
    {"WFB", "minimum frontal breadth", "frontotemporale left", "frontotemporale right", "", 99.0,
     4.5, 95.5, 4.2},
    {"MFB", "bimental breadth", "lateral mandibular border left", "lateral mandibular border right",
     "", 46.0, 2.6, 44.0, 2.5},
};

// Correlation within populations and sexes of the same data set, pooled; lower triangle, by row.
constexpr double kCorrelation[] = {
    1.000,  0.978,  1.000,  0.513,  0.519,  1.000,  0.355, 0.340,  0.474,  1.000, 0.285,  0.290,
    0.095,  0.248,  1.000,  0.260,  0.260,  0.141,  0.308, 0.636,  1.000,  0.325, 0.314,  0.383,
    0.313,  0.423,  0.377,  1.000,  0.301,  0.295,  0.306, 0.272,  0.583,  0.402, 0.788,  1.000,
    0.358,  0.352,  0.212,  0.199,  0.449,  0.277,  0.344, 0.450,  1.000,  0.399, 0.396,  0.629,
    0.172,  0.025,  0.037,  0.265,  0.174,  0.159,  1.000, 0.323,  0.353,  0.318, 0.224,  0.184,
    0.195,  0.303,  0.279,  0.154,  0.264,  1.000,  0.273, 0.304,  0.334,  0.176, 0.183,  0.190,
    0.335,  0.312,  0.165,  0.107,  0.735,  1.000,  0.324, 0.319,  0.388,  0.260, 0.304,  0.345,
    0.783,  0.587,  0.277,  0.347,  0.287,  0.295,  1.000, 0.206,  0.208,  0.209, 0.069,  0.061,
    0.098,  0.237,  0.168,  0.136,  0.281,  0.057,  0.146, 0.335,  1.000,  0.291, 0.283,  0.303,
    0.225,  0.215,  0.176,  0.411,  0.382,  0.223,  0.354, 0.316,  0.269,  0.459, 0.281,  1.000,
    0.160,  0.164,  0.101,  0.107,  0.109,  0.066,  0.208, 0.187,  0.207,  0.078, 0.182,  0.150,
    0.197,  0.072,  0.194,  1.000,  0.124,  0.150,  0.139, 0.076,  0.135,  0.151, 0.235,  0.208,
    0.113,  -0.021, 0.394,  0.436,  0.190,  0.020,  0.065, 0.047,  1.000,  0.275, 0.280,  0.323,
    0.152,  0.162,  0.171,  0.420,  0.309,  0.198,  0.237, 0.304,  0.272,  0.519, 0.168,  0.277,
    0.130,  0.315,  1.000,  0.213,  0.218,  0.235,  0.097, 0.109,  0.266,  0.273, 0.190,  0.069,
    0.194,  0.076,  0.060,  0.397,  0.330,  0.207,  0.082, -0.030, -0.032, 1.000, 0.128,  0.164,
    0.219,  0.033,  0.058,  0.103,  0.101,  0.057,  0.096, 0.102,  0.077,  0.096, 0.176,  0.209,
    0.061,  0.104,  -0.017, 0.029,  0.397,  1.000,  0.253, 0.247,  0.293,  0.207, 0.173,  0.178,
    0.494,  0.369,  0.172,  0.340,  0.254,  0.228,  0.588, 0.331,  0.455,  0.172, 0.065,  0.269,
    0.351,  0.140,  1.000,  0.357,  0.352,  0.392,  0.222, 0.245,  0.354,  0.572, 0.424,  0.250,
    0.333,  0.282,  0.243,  0.729,  0.341,  0.385,  0.175, 0.247,  0.649,  0.515, 0.231,  0.464,
    1.000,  0.358,  0.355,  0.390,  0.209,  0.247,  0.337, 0.595,  0.441,  0.252, 0.351,  0.279,
    0.247,  0.770,  0.372,  0.415,  0.166,  0.245,  0.697, 0.521,  0.231,  0.514, 0.912,  1.000,
    0.542,  0.548,  0.223,  0.497,  0.383,  0.355,  0.250, 0.265,  0.220,  0.126, 0.264,  0.238,
    0.225,  0.123,  0.225,  0.114,  0.104,  0.171,  0.080, 0.023,  0.185,  0.189, 0.187,  1.000,
    0.501,  0.485,  0.126,  0.384,  0.171,  0.249,  0.165, 0.137,  0.169,  0.135, 0.105,  0.044,
    0.169,  0.091,  0.133,  0.113,  0.003,  0.087,  0.125, 0.040,  0.146,  0.197, 0.178,  0.252,
    1.000,  0.404,  0.428,  0.168,  0.379,  0.230,  0.153, 0.100,  0.137,  0.251, 0.089,  0.100,
    0.052,  0.089,  0.059,  0.126,  0.123,  0.044,  0.106, 0.023,  0.058,  0.084, 0.101,  0.106,
    0.206,  -0.018, 1.000,  0.224,  0.223,  0.162,  0.158, 0.073,  0.107,  0.212, 0.207,  0.170,
    0.039,  0.131,  0.182,  0.143,  0.055,  0.114,  0.010, 0.157,  0.139,  0.045, -0.032, 0.047,
    0.133,  0.144,  0.080,  0.048,  -0.011, 1.000,  0.191, 0.196,  0.069,  0.285, 0.562,  0.827,
    0.236,  0.275,  0.210,  0.002,  0.120,  0.070,  0.205, 0.064,  0.079,  0.045, 0.086,  0.109,
    0.209,  0.106,  0.103,  0.245,  0.217,  0.327,  0.224, 0.148,  0.033,  1.000, 0.248,  0.219,
    -0.036, 0.196,  0.246,  0.382,  0.036,  0.075,  0.037, -0.073, 0.025,  0.039, -0.002, 0.007,
    0.007,  -0.058, 0.039,  -0.047, 0.053,  -0.058, 0.002, -0.007, -0.021, 0.587, 0.130,  0.001,
    -0.018, 0.376,  1.000,  0.051,  0.031,  -0.041, 0.162, 0.046,  0.124,  0.038, 0.017,  -0.021,
    -0.007, -0.026, -0.045, 0.038,  0.015,  -0.002, 0.014, -0.064, -0.027, 0.013, -0.021, 0.020,
    0.039,  0.023,  -0.008, 0.655,  -0.269, -0.021, 0.089, -0.006, 1.000,  0.510, 0.495,  0.047,
    0.025,  0.127,  0.008,  0.040,  0.078,  0.216,  0.078, 0.107,  0.041,  0.054, 0.060,  0.067,
    0.077,  0.019,  0.066,  0.053,  0.052,  0.070,  0.068, 0.072,  0.138,  0.001, 0.502,  -0.103,
    0.019,  0.091,  -0.286, 1.000,
};

/// A measure of the mandible goes with one of the cranium; with the others only through that one.
struct Company {
  int of;
  int with;
  double correlation;
};

/// Our assumption: no data set at hand holds both bones.
constexpr Company kCompany[] = {{31, 6, 0.5},  {32, 7, 0.7}, {33, 10, 0.35}, {34, 10, 0.5},
                                {35, 34, 0.8}, {36, 5, 0.6}, {37, 31, 0.4}};

constexpr int kCranial = 31;

}  // namespace

std::span<const Craniometric> craniometric_table() { return kMeasures; }

Eigen::MatrixXd craniometric_correlation() {
  constexpr auto kCount = static_cast<int>(std::size(kMeasures));
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(kCount, kCount);
  const double* next = kCorrelation;
  for (int row = 0; row < kCranial; ++row) {
    for (int column = 0; column <= row; ++column) {
      correlation(row, column) = correlation(column, row) = *next++;
    }
  }
  for (const Company& company : kCompany) {
    for (int other = 0; other < company.of; ++other) {
      const double through = company.correlation * correlation(company.with, other);
      correlation(company.of, other) = correlation(other, company.of) = through;
    }
  }
  return correlation;
}

}  // namespace skullstation
