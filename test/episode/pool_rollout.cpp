// Steps a pool for comparison with Gymnasium's vector environments. Commands, in pipe.h's format:
//
//   make ID MODE NUM_ENVS NUM_THREADS [NAME=VALUE ...]  -> nothing
//   reset ENVIRONMENT=SEED|- ...  -> rows of all environments; - continues the generator
//   step + num_envs x action      -> rows of all environments
//   send + num_envs x action      -> the same, through send and recv
//
// A row is reward, terminated, truncated, episodes, steps, observation, info, final observation,
// final info; a number that this call did not write is -12345.
#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/parameter_text.h"
#include "episode/pool_arrays.h"
#include "pipe.h"
#include "walker_sim/registry.h"

namespace {

using walker::Answer;
using walker::AutoresetMode;
using walker::read;

class Session {
 public:
  Answer obey(const std::string& line) {
    std::istringstream words(line);
    const auto command = read<std::string>(words);
    if (command == "make") return make(words);
    if (!pool_) throw std::logic_error("no pool yet; make one first");
    if (command == "reset") return reset(words);
    if (command == "step") return step();
    if (command == "send") return send();
    throw std::invalid_argument("command " + command + ": unknown");
  }

 private:
  static AutoresetMode mode_of(const std::string& text) {
    if (const auto mode = walker::find_autoreset_mode(text)) return *mode;
    throw std::invalid_argument("mode " + text + ": unknown");
  }

  Answer make(std::istream& words) {
    const auto id = read<std::string>(words);
    walker::PoolOptions options;
    options.autoreset_mode = mode_of(read<std::string>(words));
    options.num_envs = read<std::size_t>(words);
    options.num_threads = read<std::size_t>(words);
    const walker::Parameters parameters =
        walker::parse_assignments(walker::parameter_descriptions(id), walker::read_rest(words));
    pool_ = std::make_unique<walker::Pool>([&] { return walker::make(id, parameters); }, options);
    return {};
  }

  Answer reset(std::istream& words) {
    std::vector<std::uint32_t> environments;
    std::vector<std::optional<std::uint64_t>> seeds;
    for (const std::string& word : walker::read_rest(words)) {
      const std::size_t equals = word.find('=');
      environments.push_back(static_cast<std::uint32_t>(std::stoul(word.substr(0, equals))));
      const std::string seed = word.substr(equals + 1);
      seeds.push_back(seed == "-" ? std::nullopt : std::optional<std::uint64_t>(std::stoull(seed)));
    }
    walker::PoolArrays arrays = new_arrays();
    pool_->reset(environments, seeds, arrays.batch());
    return rows_of(arrays);
  }

  Answer step() {
    const std::vector<double> actions = walker::read_numbers(num_actions());
    walker::PoolArrays arrays = new_arrays();
    pool_->step(actions.data(), actions.size(), arrays.batch());
    return rows_of(arrays);
  }

  Answer send() {
    const std::vector<double> actions = walker::read_numbers(num_actions());
    std::vector<std::uint32_t> environments(pool_->options().num_envs);
    std::iota(environments.begin(), environments.end(), 0);
    pool_->send(actions.data(), environments.data(), environments.size());
    walker::PoolArrays arrays = new_arrays();
    pool_->recv(arrays.batch(), environments.data());
    std::vector<std::vector<double>> rows(environments.size());
    for (std::size_t i = 0; i < rows.size(); ++i) rows[environments[i]] = arrays.row(i);
    Answer answer;
    for (const std::vector<double>& row : rows) answer.add_all(row);
    return answer;
  }

  std::size_t num_actions() const {
    return pool_->options().num_envs * pool_->specification().action_size();
  }

  walker::PoolArrays new_arrays() const {
    return {pool_->specification(), pool_->options().num_envs};
  }

  Answer rows_of(const walker::PoolArrays& arrays) const {
    Answer answer;
    for (std::size_t i = 0; i < pool_->options().num_envs; ++i) answer.add_all(arrays.row(i));
    return answer;
  }

  std::unique_ptr<walker::Pool> pool_;
};

}  // namespace

int main() {
  Session session;
  walker::serve([&](const std::string& line) { return session.obey(line); });
  return 0;
}
