# Everything the project stands on, all from Debian's packages (packages.txt). Each is found once,
# here, and wrapped where its own CMake files would leak flags or whole families of libraries.

find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto SSL)
find_package(Boost 1.74 REQUIRED)
find_package(ZLIB REQUIRED)
find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs calib3d aruco)
find_package(embree 3 REQUIRED)
find_package(Ceres REQUIRED)
find_package(toml11 REQUIRED)
find_package(CLI11 REQUIRED)
find_package(GTest)
find_package(benchmark)

pkg_check_modules(gpiod REQUIRED IMPORTED_TARGET libgpiod)
pkg_check_modules(exiv2 REQUIRED IMPORTED_TARGET exiv2)
pkg_check_modules(libjpeg REQUIRED IMPORTED_TARGET libjpeg)
pkg_check_modules(sqlite3 REQUIRED IMPORTED_TARGET sqlite3)
pkg_check_modules(argon2 REQUIRED IMPORTED_TARGET libargon2)
pkg_check_modules(systemd REQUIRED IMPORTED_TARGET libsystemd)
# CSI cameras only; a station with USB cameras builds and runs without it.
pkg_check_modules(libcamera IMPORTED_TARGET libcamera)

# tl::expected is one header.
find_path(TL_EXPECTED_INCLUDE_DIR tl/expected.hpp REQUIRED)
