#include <algorithm>

#include "graph/executor_state.hpp"
#include "graph/memory_plan.hpp"

namespace vivant {
namespace {

/// The steps between which each arena value must keep its memory, by root value.
struct Lifetimes {
  std::map<int, MemoryRequest> requests;

  void touch(int root, std::size_t bytes, int step) {
    auto [entry, fresh] = requests.try_emplace(root, MemoryRequest{bytes, step, step});
    if (!fresh) entry->second.last = std::max(entry->second.last, step);
  }
};

}  // namespace

void Executor::State::place_values(const Values& outputs) {
  const auto& values = graph.values();
  Lifetimes lifetimes;
  const auto touch = [&](int id, int step) {
    const int root = graph.root(id);
    if (values[root].storage == Graph::Storage::arena)
      lifetimes.touch(root, bytes_of(values[root].type), step);
    if (values[id].type.count >= 0) {
      const int count = graph.root(values[id].type.count);
      if (values[count].storage == Graph::Storage::arena) lifetimes.touch(count, 4, step);
    }
  };
  std::vector<MemoryRequest> requests;
  std::vector<std::pair<std::size_t, std::size_t>> scratch_owner;  // planned node, index
  for (std::size_t p = 0; p < nodes.size(); ++p) {
    const Graph::Node& node = graph.nodes()[nodes[p].node];
    TensorTypes in_types;
    for (const Value& in : node.inputs) {
      in_types.push_back(in ? in.type() : TensorType{});
      if (in) touch(in.id, static_cast<int>(p));
    }
    for (const Value& out : node.outputs)
      if (!skipped(node, out)) touch(out.id, static_cast<int>(p));
    const TensorTypes workspaces = node.op->workspaces(in_types);
    scratch.emplace_back(workspaces.size());
    for (std::size_t w = 0; w < workspaces.size(); ++w) {
      requests.push_back({bytes_of(workspaces[w]), static_cast<int>(p), static_cast<int>(p)});
      scratch_owner.emplace_back(p, w);
    }
  }
  for (const Value& output : outputs) {
    touch(output.id, static_cast<int>(nodes.size()));
    readable.insert(graph.root(output.id));
    if (const Value count = output.count()) readable.insert(graph.root(count.id));
  }
  std::vector<int> value_owner;
  for (auto& [root, request] : lifetimes.requests) {
    requests.push_back(request);
    value_owner.push_back(root);
  }

  const bool separately = options.separate_buffers || options.guard_bytes > 0;
  const std::size_t largest = std::min<std::size_t>(options.slab_bytes, device.info().largest_buffer_bytes);
  const MemoryPlan plan = plan_memory(requests, device.alignment(), largest);
  lower_bound = plan.lower_bound;
  if (!separately)
    for (std::size_t bytes : plan.slab_bytes) {
      slabs.push_back(device.allocate(bytes));
      arena += bytes;
    }
  for (std::size_t r = 0; r < requests.size(); ++r) {
    const bool is_scratch = r < scratch_owner.size();
    const int root = is_scratch ? -1 : value_owner[r - scratch_owner.size()];
    const std::string owner =
        is_scratch ? "a workspace of " + describe(graph.nodes()[nodes[scratch_owner[r].first].node])
                   : "an output of " + values[root].name;
    Buffer buffer = separately ? separate(requests[r].bytes, owner)
                               : device.view(slabs[requests[r].slab], requests[r].offset, requests[r].bytes);
    if (is_scratch)
      scratch[scratch_owner[r].first][scratch_owner[r].second] = std::move(buffer);
    else
      memory.emplace(root, std::move(buffer));
  }
  for (std::size_t id = 0; id < values.size(); ++id) {
    const Graph::ValueRecord& record = values[id];
    const std::size_t bytes = bytes_of(record.type);
    if (record.storage == Graph::Storage::external) {
      if (record.placement.offset + bytes > record.placement.buffer->bytes())
        fail("[{}] {} does not fit into its buffer", record.name, record.type.shape.text());
      memory.emplace(static_cast<int>(id),
                     device.view(*record.placement.buffer, record.placement.offset, bytes));
    } else if (record.storage == Graph::Storage::input ||
               (record.storage == Graph::Storage::constant && value_needed[id])) {
      memory.emplace(static_cast<int>(id),
                     separately ? separate(bytes, record.name) : device.allocate(bytes));
    }
  }
}

}  // namespace vivant
