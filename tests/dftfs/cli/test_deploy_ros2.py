"""The ros2_control package calls law and guard as a program in C does, by stand-ins of ROS.

The stand-ins below have the names, types and signatures that the plugin uses of ROS 2 Humble; that
the plugin builds against ROS itself is not shown here.
"""

import json
import shutil
import subprocess
import xml.etree.ElementTree as ET

import pytest

from dftfs.cli.main import main
from tests.dftfs.cli.test_deploy import SCENARIO

COMPILER = shutil.which("c++") or shutil.which("g++")
INCLUDES = (
    "controller_interface/controller_interface.hpp", "pluginlib/class_list_macros.hpp",
    "realtime_tools/realtime_buffer.hpp", "rclcpp/rclcpp.hpp",
    "std_msgs/msg/float64_multi_array.hpp",
)  # fmt: skip
STAND_INS = r"""
#pragma once
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>
namespace std_msgs::msg {
struct Float64MultiArray {
  using SharedPtr = std::shared_ptr<Float64MultiArray>;
  std::vector<double> data;
};
}
namespace rclcpp {
struct Time {};
struct Duration { double s; double seconds() const { return s; } };
struct Logger {};
struct SystemDefaultsQoS {};
template <class M> struct Subscription { using SharedPtr = std::shared_ptr<Subscription>; };
struct Parameter {
  std::string text; double number;
  std::string as_string() const { return text; }
  double as_double() const { return number; }
};
}
inline std::string said;
#define RCLCPP_ERROR(logger, ...) do { (void)(logger); char line_[256]; \
  std::snprintf(line_, sizeof line_, __VA_ARGS__); said += line_; said += "\n"; } while (0)
namespace rclcpp_lifecycle {
struct State {};
struct LifecycleNode {
  std::map<std::string, rclcpp::Parameter> parameters;
  std::function<void(std_msgs::msg::Float64MultiArray::SharedPtr)> heard;
  rclcpp::Logger get_logger() const { return {}; }
  rclcpp::Parameter get_parameter(const std::string & name) const { return parameters.at(name); }
  template <class M, class F> typename rclcpp::Subscription<M>::SharedPtr create_subscription(
    const std::string &, const rclcpp::SystemDefaultsQoS &, F && call) { heard = call; return {}; }
};
}
namespace realtime_tools {
template <class T> struct RealtimeBuffer {
  T value{};
  void writeFromNonRT(const T & given) { value = given; }
  T * readFromRT() { return &value; }
};
}
namespace hardware_interface {
struct Loaned {
  std::string name; double * at;
  const std::string & get_name() const { return name; }
  double get_value() const { return *at; }
  void set_value(double given) { *at = given; }
};
using LoanedCommandInterface = Loaned;
using LoanedStateInterface = Loaned;
}
namespace controller_interface {
enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
enum class return_type { OK, ERROR };
enum class interface_configuration_type { ALL, INDIVIDUAL, NONE };
struct InterfaceConfiguration {
  interface_configuration_type type; std::vector<std::string> names = {};
};
class ControllerInterface {
public:
  virtual ~ControllerInterface() = default;
  virtual CallbackReturn on_init() = 0;
  virtual CallbackReturn on_configure(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_activate(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_deactivate(const rclcpp_lifecycle::State &) = 0;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual return_type update(const rclcpp::Time &, const rclcpp::Duration &) = 0;
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const { return node_; }
  unsigned int get_update_rate() const { return rate_; }
  template <class T> void auto_declare(const std::string & name, const T & value) {
    if constexpr (std::is_same_v<T, double>) node_->parameters[name] = {"", value};
    else node_->parameters[name] = {value, 0.0};
  }
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_ =
    std::make_shared<rclcpp_lifecycle::LifecycleNode>();
  unsigned int rate_ = 0;
  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;
};
}
#define PLUGINLIB_EXPORT_CLASS(own, base) static_assert(std::is_base_of_v<base, own>, "");
"""
PROGRAM = r"""
#include "src/controller.cpp"
using my_bench_ros2::Controller;
static void require(bool good, const char * what) {
  if (!good) { std::printf("FAIL: %s; said: %s\n", what, said.c_str()); std::exit(1); }
}
int main() {
  const auto good = controller_interface::CallbackReturn::SUCCESS;
  Controller c;
  double motor = 0.0, load = 0.0, command = 9.0;
  require(c.on_init() == good, "init");
  c.rate_ = 500;
  require(c.on_configure({}) != good && said.find("500") != std::string::npos, "wrong rate");
  c.rate_ = 1000;
  require(c.on_configure({}) == good, "configure");
  require(c.command_interface_configuration().names[0] == "motor/duty", "command");
  const auto names = c.state_interface_configuration().names;
  require(c.on_activate({}) != good, "nothing claimed");
  c.command_interfaces_ = {{"motor/duty", &command}};
  c.state_interfaces_ = {{names[0], &motor}, {names[1], &load}};
  require(c.on_activate({}) == good, "activate");
  c.update({}, {1e-3});
  require(command == 0.0, "zero before a reference");
  my_bench_guard guard;
  my_bench_guard_start(&guard);
  double largest = 0.0;
  for (unsigned k = 0; k < 400; ++k) {
    auto message = std::make_shared<std_msgs::msg::Float64MultiArray>();
    message->data = {std::sin(0.01 * k), 10.0 * std::cos(0.01 * k)};
    c.node_->heard(message);
    motor = 0.002 * k;
    const my_bench_input y = {message->data[0], message->data[1], 0.0, motor, load};
    c.update({}, {1e-3});
    const double wanted = my_bench_guarded(&guard, &my_bench_default_limits, &y, 1e-3, k + 2u, 1);
    require(command == wanted, "the command of law and guard");
    largest = std::fmax(largest, std::fabs(command));
  }
  require(largest > 0.01, "a command at all");
  motor = NAN;
  for (int k = 0; k < 6; ++k) c.update({}, {1e-3});
  require(command == 0.0 && said.find("tripped") != std::string::npos, "trip");
  motor = 0.0;
  c.update({}, {1e-3});
  require(command == 0.0, "zero after a trip");
  command = 1.0;
  require(c.on_deactivate({}) == good && command == 0.0, "deactivate");
  std::printf("pass\n");
  return 0;
}
"""


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler (c++ or g++)")
def test_the_plugin_gives_the_command_of_law_and_guard(tmp_path, capsys):
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    out = tmp_path / "out"
    assert main(["deploy", str(scenario), "--ros2", "--out", str(out), "--json"]) == 0
    package = out / "my_bench_ros2"
    record = json.loads(capsys.readouterr().out)
    assert str(package / "src" / "controller.cpp") in record["files"]
    texts = {path: path.read_text() for path in package.rglob("*") if path.is_file()}
    for word in ("STEM", "PERIOD_s", "COMMAND_INTERFACE", "REFERENCE_NAME", "rsea_"):
        assert not [path for path, text in texts.items() if word in text.replace("rsea_core", "")]
    assert ET.fromstring(texts[package / "package.xml"]).find("name").text == "my_bench_ros2"
    assert ET.fromstring(texts[package / "plugin.xml"]).get("path") == "my_bench_ros2"
    assert "update_rate: 1000 " in texts[package / "config" / "controllers.yaml"]
    stubs = tmp_path / "stubs"
    for name in INCLUDES:
        (stubs / name).parent.mkdir(parents=True, exist_ok=True)
        (stubs / name).write_text('#include "stand_ins.hpp"\n')
    (stubs / "stand_ins.hpp").write_text(STAND_INS)
    (tmp_path / "out" / "my_bench_ros2" / "try.cpp").write_text(PROGRAM)
    built = subprocess.run(
        [COMPILER, "-std=c++17", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-O0",
         "-ffp-contract=off", f"-I{stubs}", "-Iinclude", "-I.", "try.cpp", "-o", "try"],
        cwd=package, capture_output=True, text=True,
    )  # fmt: skip
    assert (built.returncode, built.stderr) == (0, "")
    done = subprocess.run(["./try"], cwd=package, capture_output=True, text=True)
    assert done.stdout == "pass\n"
