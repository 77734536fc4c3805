// The deployed law STEM as a controller of ros2_control: two angles in, COMMAND_NAME out.
// Law and guard are the C of this folder; see README.md for what this skeleton does not do.
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "controller_interface/controller_interface.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "realtime_tools/realtime_buffer.hpp"
#include "rclcpp/rclcpp.hpp"
#include "std_msgs/msg/float64_multi_array.hpp"

#include "STEM.h"
#include "STEM_guard.h"

namespace STEM_ros2
{
using controller_interface::CallbackReturn;
using controller_interface::InterfaceConfiguration;
using controller_interface::return_type;
using Message = std_msgs::msg::Float64MultiArray;

// reference with its first two time derivatives, and how many have come
struct Asked
{
  std::array<double, 3> values{{0.0, 0.0, 0.0}};
  unsigned count = 0u;
};

class Controller : public controller_interface::ControllerInterface
{
public:
  CallbackReturn on_init() override
  {
    auto_declare<std::string>("motor_joint", "motor");
    auto_declare<std::string>("load_joint", "load");
    auto_declare<std::string>("command_interface", "COMMAND_INTERFACE");
    auto_declare<std::string>("count_interface", "");
    auto_declare<double>("reference_timeout_s", 0.0);
    rsea_guard_start(&guard_);
    return CallbackReturn::SUCCESS;
  }

  CallbackReturn on_configure(const rclcpp_lifecycle::State &) override
  {
    const auto node = get_node();
    const std::string motor = node->get_parameter("motor_joint").as_string();
    const std::string load = node->get_parameter("load_joint").as_string();
    command_ = motor + "/" + node->get_parameter("command_interface").as_string();
    states_ = {motor + "/position", load + "/position"};
    const std::string count = node->get_parameter("count_interface").as_string();
    if (!count.empty()) states_.push_back(count);
    timeout_s_ = node->get_parameter("reference_timeout_s").as_double();
    const double rate = static_cast<double>(get_update_rate());
    if (!(rate > 0.0) || std::fabs(rate * PERIOD_s - 1.0) > 1e-6) {
      RCLCPP_ERROR(
        node->get_logger(), "update_rate is %g Hz; the law needs one call every %g s", rate,
        PERIOD_s);
      return CallbackReturn::ERROR;
    }
    subscription_ = node->create_subscription<Message>(
      "~/reference", rclcpp::SystemDefaultsQoS(), [this](const Message::SharedPtr message) {
        if (message->data.empty() || message->data.size() > 3) return;
        Asked asked;
        for (size_t j = 0; j < message->data.size(); ++j) asked.values[j] = message->data[j];
        asked.count = ++received_;
        asked_.writeFromNonRT(asked);
      });
    return CallbackReturn::SUCCESS;
  }

  InterfaceConfiguration command_interface_configuration() const override
  {
    return {controller_interface::interface_configuration_type::INDIVIDUAL, {command_}};
  }

  InterfaceConfiguration state_interface_configuration() const override
  {
    return {controller_interface::interface_configuration_type::INDIVIDUAL, states_};
  }

  CallbackReturn on_activate(const rclcpp_lifecycle::State &) override
  {
    bool ordered = command_interfaces_.size() == 1 && state_interfaces_.size() == states_.size();
    for (size_t j = 0; ordered && j < states_.size(); ++j)
      ordered = state_interfaces_[j].get_name() == states_[j];
    if (!ordered) {
      RCLCPP_ERROR(get_node()->get_logger(), "the interfaces are not those that were asked for");
      return CallbackReturn::ERROR;
    }
    rsea_guard_start(&guard_);
    seen_ = asked_.readFromRT()->count;  // an older reference does not enable
    since_s_ = 0.0;
    calls_ = 0u;
    enabled_ = false;
    told_ = rsea_good;
    return CallbackReturn::SUCCESS;
  }

  CallbackReturn on_deactivate(const rclcpp_lifecycle::State &) override
  {
    rsea_guard_start(&guard_);
    give(0.0);
    return CallbackReturn::SUCCESS;
  }

  return_type update(const rclcpp::Time &, const rclcpp::Duration & period) override
  {
    const Asked & asked = *asked_.readFromRT();
    since_s_ += period.seconds();
    if (asked.count != seen_) {
      seen_ = asked.count;
      since_s_ = 0.0;
      enabled_ = true;
    }
    if (timeout_s_ > 0.0 && since_s_ > timeout_s_) enabled_ = false;
    rsea_input y;
    y.reference = static_cast<REAL>(asked.values[0]);
    y.reference_rate = static_cast<REAL>(asked.values[1]);
    y.reference_acceleration = static_cast<REAL>(asked.values[2]);
    y.motor_angle_rad = static_cast<REAL>(state_interfaces_[0].get_value());
    y.load_angle_rad = static_cast<REAL>(state_interfaces_[1].get_value());
    unsigned count = ++calls_;
    if (states_.size() > 2) count = static_cast<unsigned>(state_interfaces_[2].get_value());
    const REAL command = rsea_guarded(
      &guard_, &rsea_default_limits, &y, static_cast<REAL>(period.seconds()), count,
      enabled_ ? 1 : 0);
    give(static_cast<double>(command));
    if (guard_.tripped != told_) {
      told_ = guard_.tripped;
      if (told_ != rsea_good)
        RCLCPP_ERROR(
          get_node()->get_logger(), "tripped (%d): the command is zero until deactivated",
          static_cast<int>(told_));
    }
    return return_type::OK;
  }

private:
  void give(double command) { static_cast<void>(command_interfaces_[0].set_value(command)); }

  rsea_guard guard_;
  rsea_fault told_ = rsea_good;
  std::string command_;
  std::vector<std::string> states_;
  realtime_tools::RealtimeBuffer<Asked> asked_;
  rclcpp::Subscription<Message>::SharedPtr subscription_;
  double timeout_s_ = 0.0, since_s_ = 0.0;
  unsigned received_ = 0u, seen_ = 0u, calls_ = 0u;
  bool enabled_ = false;
};
}  // namespace STEM_ros2

PLUGINLIB_EXPORT_CLASS(STEM_ros2::Controller, controller_interface::ControllerInterface)
