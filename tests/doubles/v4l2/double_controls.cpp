// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/v4l2/double_controls.hpp"

#include <sys/uio.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

namespace slsd::test {
namespace {

constexpr std::uint32_t kFlags = V4L2_CTRL_FLAG_NEXT_CTRL | V4L2_CTRL_FLAG_NEXT_COMPOUND;

// A restricted ioctl copies the argument, not what a pointer within it means.
bool copy_array(const v4l2_ext_controls& controls, pid_t caller, std::vector<v4l2_ext_control>& array, bool to_caller) {
  array.resize(controls.count);  // already so on the way back
  const std::size_t bytes = array.size() * sizeof(v4l2_ext_control);
  const iovec here{array.data(), bytes};
  const iovec there{controls.controls, bytes};
  const ssize_t copied =
      to_caller ? process_vm_writev(caller, &here, 1, &there, 1, 0) : process_vm_readv(caller, &here, 1, &there, 1, 0);
  return copied == static_cast<ssize_t>(bytes);
}

}  // namespace

const DoubleControl* DoubleControls::find(std::uint32_t id) const {
  const auto found = std::find_if(controls_.begin(), controls_.end(), [id](const auto& c) { return c.id == id; });
  return found == controls_.end() ? nullptr : &*found;
}

bool DoubleControls::is_inactive(std::uint32_t id) const {
  if (id == V4L2_CID_EXPOSURE_ABSOLUTE) return value(V4L2_CID_EXPOSURE_AUTO) == V4L2_EXPOSURE_APERTURE_PRIORITY;
  return id == V4L2_CID_FOCUS_ABSOLUTE && value(V4L2_CID_FOCUS_AUTO) == 1;
}

std::optional<int> DoubleControls::value(std::uint32_t id) const {
  const DoubleControl* control = find(id);
  if (control == nullptr) return std::nullopt;
  return control->value;
}

int DoubleControls::query(v4l2_queryctrl& query) const {
  const DoubleControl* control = nullptr;
  const std::uint32_t id = query.id & ~kFlags;
  for (const DoubleControl& candidate : controls_) {
    const bool next =
        (query.id & kFlags) != 0 && candidate.id > id && (control == nullptr || candidate.id < control->id);
    if (next || ((query.id & kFlags) == 0 && candidate.id == id)) control = &candidate;
  }
  if (control == nullptr) return EINVAL;
  query = {};
  query.id = control->id;
  query.type = control->type;
  std::snprintf(reinterpret_cast<char*>(query.name), sizeof query.name, "%s", control->name.c_str());
  query.minimum = control->minimum;
  query.maximum = control->maximum;
  query.step = control->step;
  query.default_value = control->value;
  query.flags = is_inactive(control->id) ? V4L2_CTRL_FLAG_INACTIVE : 0;
  return 0;
}

int DoubleControls::query_menu(v4l2_querymenu& query) const {
  const DoubleControl* control = find(query.id);
  if (control == nullptr || query.index >= control->choices.size()) return EINVAL;
  query.value = control->choices[query.index];
  return 0;
}

int DoubleControls::query_extended(v4l2_query_ext_ctrl& extended) const {
  v4l2_queryctrl plain{};
  plain.id = extended.id;
  if (const int error = query(plain)) return error;
  extended = {};
  extended.id = plain.id;
  extended.type = plain.type;
  std::snprintf(extended.name, sizeof extended.name, "%s", reinterpret_cast<const char*>(plain.name));
  extended.minimum = plain.minimum;
  extended.maximum = plain.maximum;
  extended.step = static_cast<__u64>(plain.step);
  extended.default_value = plain.default_value;
  extended.flags = plain.flags;
  extended.elem_size = sizeof(__s32);
  extended.elems = 1;
  return 0;
}

int DoubleControls::get(v4l2_control& control) const {
  const auto now = value(control.id);
  if (!now) return EINVAL;
  control.value = *now;
  return 0;
}

int DoubleControls::set(const v4l2_control& control) {
  const DoubleControl* found = find(control.id);
  if (found == nullptr) return EINVAL;
  if (control.value < found->minimum || control.value > found->maximum) return ERANGE;
  if (is_inactive(control.id)) return EACCES;
  if (std::find(refused_.begin(), refused_.end(), control.id) != refused_.end()) return 0;
  const int steps = (control.value - found->minimum) / found->step;
  controls_[found - controls_.data()].value = found->minimum + steps * found->step;
  return 0;
}

int DoubleControls::get_extended(v4l2_ext_controls& controls, pid_t caller) const {
  std::vector<v4l2_ext_control> array;
  if (!copy_array(controls, caller, array, false)) return EFAULT;
  for (std::size_t i = 0; i < array.size(); ++i) {
    const auto now = value(array[i].id);
    controls.error_idx = static_cast<__u32>(i);
    if (!now) return EINVAL;
    array[i].value = *now;
  }
  return copy_array(controls, caller, array, true) ? 0 : EFAULT;
}

int DoubleControls::set_extended(v4l2_ext_controls& controls, pid_t caller) {
  std::vector<v4l2_ext_control> array;
  if (!copy_array(controls, caller, array, false)) return EFAULT;
  for (std::size_t i = 0; i < array.size(); ++i) {
    controls.error_idx = static_cast<__u32>(i);
    if (const int error = set({array[i].id, array[i].value})) return error;
  }
  return 0;
}

}  // namespace slsd::test
