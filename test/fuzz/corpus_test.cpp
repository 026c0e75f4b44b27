// The fuzz targets without a fuzzer: over their corpora, which hold all that was ever found, and
// over seeded mutations of these. A fault ends the program; the last line says at which input.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "fuzz/target.h"

namespace walker::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string present;  // the input under way

/// Prints the present input. Calls only what a signal handler may call.
extern "C" void tell_input(int signal) {
  const char newline = '\n';
  if (write(STDERR_FILENO, present.data(), present.size()) < 0 ||
      write(STDERR_FILENO, &newline, 1) < 0) {
    std::_Exit(1);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

std::vector<std::filesystem::path> corpus_of(const Target& target) {
  const std::filesystem::path folder =
      std::filesystem::path(WALKER_SIM_SOURCE_DIR) / "test" / "fuzz" / "corpus" / target.name;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Bytes read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Changes bytes at random, without knowledge of their format.
class Mutator {
 public:
  explicit Mutator(std::vector<Bytes> corpus) : corpus_(std::move(corpus)) {}

  Bytes mutant() {
    Bytes bytes = corpus_[below(corpus_.size())];
    for (std::size_t changes = 1 + below(4); changes > 0; --changes) change(bytes);
    return bytes;
  }

 private:
  std::size_t below(std::size_t end) { return end == 0 ? 0 : generator_() % end; }

  void change(Bytes& bytes) {
    if (bytes.empty()) bytes.push_back(0);
    const std::size_t place = below(bytes.size());
    const std::size_t length = 1 + below(std::min<std::size_t>(bytes.size() - place, 64));
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(place);
    const auto end = begin + static_cast<std::ptrdiff_t>(length);
    switch (below(6)) {
      case 0:
        bytes[place] = static_cast<std::uint8_t>(bytes[place] ^ (1U << below(8)));
        break;
      case 1:
        bytes[place] = static_cast<std::uint8_t>(below(256));
        break;
      case 2:
        set_number(bytes, place);
        break;
      case 3:
        bytes.erase(begin, end);
        break;
      case 4: {
        const Bytes copy(begin, end);
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size())), copy.begin(),
                     copy.end());
        break;
      }
      default: {
        const Bytes& other = corpus_[below(corpus_.size())];
        const std::size_t from = below(other.size());
        bytes.resize(place);
        bytes.insert(bytes.end(), other.begin() + static_cast<std::ptrdiff_t>(from), other.end());
      }
    }
  }

  /// Overwrites a number of 1, 2, 4 or 8 bytes by a limit at which lengths and indices overflow.
  void set_number(Bytes& bytes, std::size_t place) {
    constexpr std::uint64_t kValues[] = {0,
                                         1,
                                         0x7f,
                                         0x80,
                                         0xff,
                                         0x7fff,
                                         0xffff,
                                         0x7f7fffff,  // the largest float
                                         0x7f800000,  // infinity
                                         0x7fffffff,
                                         0x80000000,
                                         0xffffffff,
                                         1ULL << 63,
                                         ~0ULL,
                                         0x7fefffffffffffff,
                                         0x7ff0000000000000,
                                         0x7ff8000000000000};
    const std::uint64_t value = kValues[below(std::size(kValues))];
    const std::size_t width = std::min(std::size_t{1} << below(4), bytes.size() - place);
    std::memcpy(&bytes[place], &value, width);
  }

  std::vector<Bytes> corpus_;
  std::mt19937_64 generator_{1};  // always the same
};

class CorpusTest : public testing::TestWithParam<Target> {
 protected:
  void SetUp() override {
    for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL}) std::signal(signal, tell_input);
  }

  static void run(const std::string& name, const Bytes& bytes) {
    present = "at " + std::string(GetParam().name) + ", " + name;
    GetParam().run(bytes.data(), bytes.size());
  }
};

TEST_P(CorpusTest, SurvivesItsCorpus) {
  const auto files = corpus_of(GetParam());
  ASSERT_FALSE(files.empty());
  for (const auto& file : files) {
    const std::string name = file.filename();
    is_seed = name.rfind("seed_", 0) == 0;
    run(name, read(file));
  }
  is_seed = false;
  run("empty", {});
}

TEST_P(CorpusTest, SurvivesMutations) {
  constexpr int kMutants = 2000;
  std::vector<Bytes> corpus;
  for (const auto& file : corpus_of(GetParam())) corpus.push_back(read(file));
  Mutator mutator(corpus);
  for (int i = 0; i < kMutants; ++i) run("mutant " + std::to_string(i), mutator.mutant());
}

INSTANTIATE_TEST_SUITE_P(Fuzz, CorpusTest, testing::ValuesIn(targets()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace walker::fuzz
