#include "vivant/ops/registry.hpp"

#include <algorithm>

namespace vivant {
namespace {

std::vector<OpInfo>& registered() {
  static std::vector<OpInfo> ops;
  return ops;
}

}  // namespace

RegisterOp::RegisterOp(OpInfo info) {
  auto& ops = registered();
  ops.insert(std::upper_bound(ops.begin(), ops.end(), info,
                              [](const OpInfo& a, const OpInfo& b) { return a.name < b.name; }),
             std::move(info));
}

const std::vector<OpInfo>& all_ops() { return registered(); }

const OpInfo& op_info(const std::string& name) {
  for (const OpInfo& info : registered())
    if (info.name == name) return info;
  throw UsageError(fmt::format("there is no op '{}': `vivant op list` names them", name));
}

Attributes OpInfo::complete(const nlohmann::json& given) const {
  nlohmann::json values = nlohmann::json::object();
  for (const AttributeInfo& attribute : attributes) values[attribute.name] = attribute.standard;
  for (const auto& [key, value] : given.items()) {
    if (!values.contains(key)) throw UsageError(fmt::format("the op {} has no attribute '{}'", name, key));
    const bool fits = values[key].type() == value.type() ||
                      (values[key].is_number_float() && value.is_number()) ||
                      (values[key].is_number_integer() && value.is_number_integer());
    if (!fits)
      throw UsageError(fmt::format("the attribute {} of the op {} is a {}, not {}", key, name,
                                   values[key].type_name(), value.dump()));
    values[key] = value;
  }
  return Attributes(values);
}

}  // namespace vivant
