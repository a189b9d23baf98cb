// The fit of benches/fit.rs by Ceres with automatic differentiation: a rigid UR10, its 25 identifiable parameters or all 33, within the
// bounds and under the loss that the file names.
//
//   fit <csv> <qr|cholesky> <repeats>
//
// Prints the median time of ceres::Solve in milliseconds, the final cost 1/2 |r|^2 and the number of steps. The CSV
// (written by the bench `peers`) holds the nominal arm, the list of unknowns and the poses.

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr int kJoints = 6;
constexpr int kScalars = 5 * kJoints + 3;  // alpha, a, theta, d, beta of each joint; target

struct Arm {
  std::array<double, kScalars> nominal;
  std::array<int, kScalars> unknown;  // index of the unknown, or -1
  double sigma;
  std::vector<double> bounds;  // lower, then upper; or none
  std::string loss;
};

// One pose: (measured - predicted) / sigma. The point is carried from the last frame inwards, the cheapest way to a
// position: two multiplications and additions per coordinate and rotation.
struct Residual {
  const Arm& arm;
  std::array<double, kJoints> q;
  std::array<double, 3> measured;

  template <typename T>
  bool operator()(const T* x, T* residual) const {
    using std::cos;
    using std::sin;
    auto scalar = [&](int k) { return arm.unknown[k] < 0 ? T(arm.nominal[k]) : arm.nominal[k] + x[arm.unknown[k]]; };
    T px = scalar(30), py = scalar(31), pz = scalar(32);
    auto turn = [&](int k, double offset, T& u, T& v) {
      if (arm.unknown[k] < 0) {
        const double angle = arm.nominal[k] + offset;
        const double s = std::sin(angle), c = std::cos(angle);
        const T first = u * c - v * s;
        v = u * s + v * c;
        u = first;
      } else {
        const T angle = scalar(k) + offset;
        const T s = sin(angle), c = cos(angle);
        const T first = u * c - v * s;
        v = u * s + v * c;
        u = first;
      }
    };
    for (int i = kJoints - 1; i >= 0; --i) {
      turn(5 * i + 4, 0.0, pz, px);
      pz += scalar(5 * i + 3);
      turn(5 * i + 2, q[i], px, py);
      px += scalar(5 * i + 1);
      turn(5 * i, 0.0, py, pz);
    }
    residual[0] = (measured[0] - px) / arm.sigma;
    residual[1] = (measured[1] - py) / arm.sigma;
    residual[2] = (measured[2] - pz) / arm.sigma;
    return true;
  }
};

std::vector<double> Numbers(const std::string& line) {
  std::vector<double> out;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) out.push_back(std::stod(cell));
  return out;
}

// The loss on the length of a pose's residual. flexcal's l1 of slope c and smoothing e is c/e times Ceres' soft L1 at e.
ceres::LossFunction* Loss(const std::string& words) {
  std::stringstream stream(words);
  std::string name, first, second;
  std::getline(stream, name, ',');
  std::getline(stream, first, ',');
  std::getline(stream, second, ',');
  if (name == "huber") return new ceres::HuberLoss(std::stod(first));
  if (name != "l1") return nullptr;
  const double slope = std::stod(first), smoothing = std::stod(second);
  return new ceres::ScaledLoss(new ceres::SoftLOneLoss(smoothing), slope / smoothing, ceres::TAKE_OWNERSHIP);
}

// Fits `arm` to the poses that the rest of the file holds.
template <int kUnknowns>
int Fit(const Arm& arm, std::ifstream& file, const std::string& linear_solver, int repeats) {
  double x[kUnknowns] = {};
  ceres::Problem problem;
  ceres::LossFunction* loss = Loss(arm.loss);
  for (std::string line; std::getline(file, line);) {
    const auto row = Numbers(line);
    auto* residual = new Residual{arm, {}, {}};
    std::copy_n(row.begin(), kJoints, residual->q.begin());
    std::copy_n(row.begin() + kJoints, 3, residual->measured.begin());
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Residual, 3, kUnknowns>(residual), loss, x);
  }
  for (size_t k = 0; k < arm.bounds.size() / 2; ++k) {
    problem.SetParameterLowerBound(x, static_cast<int>(k), arm.bounds[k]);
    problem.SetParameterUpperBound(x, static_cast<int>(k), arm.bounds[k + arm.bounds.size() / 2]);
  }

  ceres::Solver::Options options;
  options.linear_solver_type = linear_solver == "qr" ? ceres::DENSE_QR : ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 1000;
  options.num_threads = 1;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-10;
  options.gradient_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  std::vector<double> times;
  ceres::Solver::Summary summary;
  for (int k = 0; k < std::max(1, repeats); ++k) {
    std::fill_n(x, kUnknowns, 0.0);
    const auto begin = std::chrono::steady_clock::now();
    ceres::Solve(options, &problem, &summary);
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  std::sort(times.begin(), times.end());
  std::printf("%.4f %.9e %d\n", times[times.size() / 2], summary.final_cost,
              static_cast<int>(summary.iterations.size()) - 1);
  return summary.IsSolutionUsable() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: fit <csv> <qr|cholesky> <repeats>\n");
    return 2;
  }
  google::InitGoogleLogging(argv[0]);
  std::ifstream file(argv[1]);
  Arm arm{};
  std::string line;
  std::getline(file, line);
  arm.sigma = std::stod(line);
  std::getline(file, line);
  auto nominal = Numbers(line);
  std::copy(nominal.begin(), nominal.end(), arm.nominal.begin());
  std::getline(file, line);
  arm.unknown.fill(-1);
  int next = 0;
  for (double k : Numbers(line)) arm.unknown[static_cast<int>(k)] = next++;
  std::getline(file, line);
  arm.bounds = Numbers(line);
  std::getline(file, arm.loss);
  if (nominal.size() == kScalars && next == 25) return Fit<25>(arm, file, argv[2], std::atoi(argv[3]));
  if (nominal.size() == kScalars && next == 33) return Fit<33>(arm, file, argv[2], std::atoi(argv[3]));
  std::fprintf(stderr, "%s: not the arm that this program is built for\n", argv[1]);
  return 2;
}
