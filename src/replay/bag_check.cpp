#include "replay/bag_check.h"

#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>

#include <rosbag/chunked_file.h>
#include <rosbag/constants.h>

#include "wire/message_reader.h"
#include "wire/tcpros.h"

namespace walker {
namespace {

// Format: wiki.ros.org/Bags/Format/2.0

using tcpros::Fields;
using tcpros::kLengthBytes;

constexpr std::uint64_t kMaxHeader = std::uint64_t{1} << 20U;
constexpr std::uint64_t kMaxChunk = std::uint64_t{1} << 28U;

/// A defect and its offset; check_bag() adds the file's name.
struct Fault : std::runtime_error {
  Fault(bool is_cut, std::uint64_t place, const std::string& what)
      : runtime_error((is_cut ? "is not a bag, or is cut off: " : "is damaged: ") +
                      std::string("at byte ") + std::to_string(place) + ": " + what) {}
};

/// Reader of a part of the file or of a decompressed chunk.
class Part : public MessageReader {
 public:
  /// @param place offset of the first byte in the file; for a compressed chunk, that of its record
  Part(std::string_view bytes, std::uint64_t place)
      : MessageReader(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(),
                      "a record"),
        end_(place + bytes.size()) {}

  /// Offset of the next byte.
  std::uint64_t place() const { return end_ - size(); }

 private:
  std::uint64_t end_;
};

Fields read_fields(Part header) {
  const std::uint64_t size = header.size();
  Fields fields;
  while (header.size() > 0) {
    const std::uint64_t place = header.place();
    const std::optional<tcpros::Field> field = tcpros::take_field(header);
    if (!field && header.size() < kLengthBytes) {
      throw Fault(false, place, "a header ends within a field's length");
    }
    if (!field) {
      throw Fault(false, place,
                  "a field of " + std::to_string(header.number<std::uint32_t>()) +
                      " bytes in a header of " + std::to_string(size));
    }
    if (field->name.empty()) throw Fault(false, place, "a field without a name");
    fields[std::string(field->name)] = field->value;
  }
  return fields;
}

/// @param place offset of the record
/// @throws Fault if the field is missing or of another size
template <typename Number>
Number field(const Fields& fields, const std::string& name, std::uint64_t place) {
  const auto found = fields.find(name);
  if (found == fields.end()) throw Fault(false, place, "a record without " + name);
  Part value(found->second, place);
  if (value.size() != sizeof(Number)) {
    throw Fault(false, place,
                name + " has " + std::to_string(value.size()) + " bytes; must have " +
                    std::to_string(sizeof(Number)));
  }
  return value.number<Number>();
}

std::uint8_t op_of(const Fields& fields, std::uint64_t place) {
  return field<std::uint8_t>(fields, rosbag::OP_FIELD_NAME, place);
}

/// Connection ids of a chunk's messages, by the offsets of their records in the chunk.
using Messages = std::map<std::uint32_t, std::uint32_t>;

void check_connection(const Fields& fields, const Part& data, std::uint64_t place) {
  field<std::uint32_t>(fields, rosbag::CONNECTION_FIELD_NAME, place);
  if (fields.count(rosbag::TOPIC_FIELD_NAME) == 0) {
    throw Fault(false, place, "a connection without a topic");
  }
  read_fields(data);
}

/// Reads a length and as many bytes.
Part take(Part& chunk, const char* what) {
  const std::uint64_t place = chunk.place();
  if (const auto taken = chunk.try_text()) return {*taken, place + kLengthBytes};
  if (chunk.size() < kLengthBytes) {
    throw Fault(false, place, std::string("a chunk ends within ") + what);
  }
  const auto length = chunk.number<std::uint32_t>();
  throw Fault(false, place,
              std::string(what) + " has " + std::to_string(length) + " bytes; its chunk only " +
                  std::to_string(chunk.size()) + " more");
}

Messages read_chunk(Part chunk) {
  Messages messages;
  const std::uint64_t begin = chunk.place();
  while (chunk.size() > 0) {
    const std::uint64_t place = chunk.place();
    const Fields fields = read_fields(take(chunk, "a header"));
    const Part data = take(chunk, "a record");
    const std::uint8_t op = op_of(fields, place);
    if (op == rosbag::OP_CONNECTION) {
      check_connection(fields, data, place);
    } else if (op == rosbag::OP_MSG_DATA) {
      field<std::uint64_t>(fields, rosbag::TIME_FIELD_NAME, place);
      messages[static_cast<std::uint32_t>(place - begin)] =
          field<std::uint32_t>(fields, rosbag::CONNECTION_FIELD_NAME, place);
    } else {
      throw Fault(false, place, "a record of kind " + std::to_string(op) + " in a chunk");
    }
  }
  return messages;
}

class Checker {
 public:
  explicit Checker(const std::string& path)
      : path_(path), file_(path, std::ios::binary), size_(std::filesystem::file_size(path)) {}

  void check() {
    const std::string version = "#ROSBAG V" + rosbag::VERSION + "\n";
    std::string found(version.size(), ' ');
    if (size_ < version.size()) throw Fault(true, size_, "no more follows");
    file_.read(found.data(), static_cast<std::streamsize>(found.size()));
    if (found != version) throw Fault(true, 0, "must begin with #ROSBAG V" + rosbag::VERSION);
    place_ = version.size();
    read_record();
    if (op_ != rosbag::OP_FILE_HEADER) throw Fault(true, record_, "no header of a bag");
    if (!read_file_header()) return;
    while (place_ < size_) {
      read_record();
      check_record();
    }
    check_index();
  }

 private:
  std::uint32_t read_length(const char* what) {
    if (size_ - place_ < kLengthBytes)
      throw Fault(true, place_, std::string("ends within ") + what);
    std::uint32_t length = 0;
    file_.read(reinterpret_cast<char*>(&length), kLengthBytes);
    place_ += kLengthBytes;
    if (length > size_ - place_) {
      throw Fault(true, place_ - kLengthBytes,
                  std::string(what) + " of " + std::to_string(length) + " bytes, where " +
                      std::to_string(size_ - place_) + " follow");
    }
    return length;
  }

  /// Reads the file's next `size` bytes into `buffer`.
  Part read(std::uint64_t size, std::string& buffer) {
    buffer.resize(size);
    file_.read(buffer.data(), static_cast<std::streamsize>(size));
    if (!file_) throw Fault(true, place_, "cannot be read");
    const Part part(buffer, place_);
    place_ += size;
    return part;
  }

  void read_record() {
    record_ = place_;
    const std::uint64_t header_size = read_length("a header");
    if (header_size > kMaxHeader) {
      throw Fault(false, record_, "a header of " + std::to_string(header_size) + " bytes");
    }
    fields_ = read_fields(read(header_size, header_));
    op_ = op_of(fields_, record_);
    const std::uint64_t data_size = read_length("a record");
    if (data_size > kMaxChunk) {
      throw Fault(false, record_,
                  "a record of " + std::to_string(data_size) + " bytes; must have at most " +
                      std::to_string(kMaxChunk));
    }
    data_ = read(data_size, buffer_);
    ops_[record_] = op_;
  }

  template <typename Number>
  Number get(const std::string& name) const {
    return field<Number>(fields_, name, record_);
  }

  void check_version(std::uint32_t known) const {
    const auto found = get<std::uint32_t>(rosbag::VER_FIELD_NAME);
    if (found == known) return;
    throw Fault(
        false, record_,
        "a record of version " + std::to_string(found) + "; must be " + std::to_string(known));
  }

  /// @return false if the bag was not closed, which rosbag reports
  bool read_file_header() {
    const auto encryptor = fields_.find(rosbag::ENCRYPTOR_FIELD_NAME);
    if (encryptor != fields_.end() && !encryptor->second.empty()) {
      throw Fault(false, record_, "encrypted; must be a plain bag");
    }
    index_ = get<std::uint64_t>(rosbag::INDEX_POS_FIELD_NAME);
    num_connections_ = get<std::uint32_t>(rosbag::CONNECTION_COUNT_FIELD_NAME);
    num_chunks_ = get<std::uint32_t>(rosbag::CHUNK_COUNT_FIELD_NAME);
    if (index_ > size_) {
      throw Fault(true, size_, "its index should be at byte " + std::to_string(index_));
    }
    return index_ != 0;
  }

  void check_record() {
    if (op_ == rosbag::OP_CHUNK) {
      messages_ = read_chunk(uncompressed());
    } else if (op_ == rosbag::OP_INDEX_DATA) {
      check_index_of_chunk();
    } else if (op_ == rosbag::OP_CONNECTION) {
      check_connection(fields_, data_, record_);
      connections_.insert(get<std::uint32_t>(rosbag::CONNECTION_FIELD_NAME));
    } else if (op_ == rosbag::OP_CHUNK_INFO) {
      check_chunk_info();
    } else if (op_ != rosbag::OP_MSG_DATA) {
      throw Fault(false, record_, "a record of unknown kind " + std::to_string(op_));
    }
  }

  /// Contents of the current record, a chunk.
  Part uncompressed() {
    const std::uint64_t size = get<std::uint32_t>(rosbag::SIZE_FIELD_NAME);
    const std::string compression = fields_[rosbag::COMPRESSION_FIELD_NAME];
    if (compression == rosbag::COMPRESSION_NONE) {
      if (size == data_.size()) return data_;
      throw Fault(false, record_,
                  "a chunk of " + std::to_string(data_.size()) + " bytes that says it has " +
                      std::to_string(size));
    }
    const bool is_bz2 = compression == rosbag::COMPRESSION_BZ2;
    if (!is_bz2 && compression != rosbag::COMPRESSION_LZ4) {
      throw Fault(false, record_, "a chunk with an unknown compression");
    }
    if (size > kMaxChunk) {
      throw Fault(false, record_,
                  "a chunk of " + std::to_string(size) + " bytes; must have at most " +
                      std::to_string(kMaxChunk));
    }
    // rosbag does not report how many bytes it wrote. If there were fewer than `size`, these two
    // differ in their filling.
    decompress(is_bz2, size, '\x55', chunk_);
    decompress(is_bz2, size, '\xaa', other_chunk_);
    if (chunk_ != other_chunk_) {
      throw Fault(false, record_, "a chunk of fewer bytes than it says, " + std::to_string(size));
    }
    return {chunk_, record_};
  }

  void decompress(bool is_bz2, std::uint64_t size, char filling, std::string& chunk) {
    chunk.assign(size, filling);
    try {
      rosbag::ChunkedFile decompressor;
      decompressor.openRead(path_);
      decompressor.decompress(is_bz2 ? rosbag::compression::BZ2 : rosbag::compression::LZ4,
                              reinterpret_cast<std::uint8_t*>(chunk.data()),
                              static_cast<unsigned int>(size),
                              reinterpret_cast<std::uint8_t*>(buffer_.data()),
                              static_cast<unsigned int>(buffer_.size()));
    } catch (const std::exception& error) {
      throw Fault(false, record_,
                  std::string("a chunk that cannot be decompressed: ") + error.what());
    }
  }

  /// Checks an index record: the offsets of one connection's messages in the chunk before it.
  void check_index_of_chunk() {
    constexpr std::uint64_t kEntrySize = 12;  // time, offset
    check_version(rosbag::INDEX_VERSION);
    const auto connection = get<std::uint32_t>(rosbag::CONNECTION_FIELD_NAME);
    const std::uint64_t count = get<std::uint32_t>(rosbag::COUNT_FIELD_NAME);
    if (count * kEntrySize != data_.size()) {
      throw Fault(false, record_,
                  "an index of " + std::to_string(count) + " messages in " +
                      std::to_string(data_.size()) + " bytes");
    }
    for (Part entries = data_; entries.size() > 0;) {
      const std::uint64_t entry = entries.place();
      entries.number<std::uint64_t>();  // seconds and nanoseconds
      const auto place = entries.number<std::uint32_t>();
      const auto found = messages_.find(place);
      if (found == messages_.end() || found->second != connection) {
        throw Fault(false, entry,
                    "an index that names a message at byte " + std::to_string(place) +
                        " of its chunk, where none of its connection is");
      }
    }
    indexed_.emplace(connection, record_);
  }

  void check_chunk_info() {
    constexpr std::uint64_t kEntrySize = 8;  // connection, number of messages
    check_version(rosbag::CHUNK_INFO_VERSION);
    get<std::uint64_t>(rosbag::START_TIME_FIELD_NAME);
    get<std::uint64_t>(rosbag::END_TIME_FIELD_NAME);
    const auto chunk = get<std::uint64_t>(rosbag::CHUNK_POS_FIELD_NAME);
    const std::uint64_t count = get<std::uint32_t>(rosbag::COUNT_FIELD_NAME);
    const auto found = ops_.find(chunk);
    if (found == ops_.end() || found->second != rosbag::OP_CHUNK) {
      throw Fault(false, record_, "no chunk at byte " + std::to_string(chunk));
    }
    if (count * kEntrySize != data_.size()) {
      throw Fault(false, record_,
                  std::to_string(count) + " connections of a chunk in " +
                      std::to_string(data_.size()) + " bytes");
    }
  }

  /// Checks the index at the file's end: all connections, then one record per chunk.
  void check_index() {
    auto record = ops_.find(index_);
    const auto expect = [&](std::uint8_t op, std::uint32_t count, const char* what) {
      for (std::uint32_t i = 0; i < count; ++i, ++record) {
        if (record == ops_.end() || record->second != op) {
          throw Fault(true, index_, "no index of " + std::to_string(count) + " " + what);
        }
      }
    };
    expect(rosbag::OP_CONNECTION, num_connections_, "connections");
    expect(rosbag::OP_CHUNK_INFO, num_chunks_, "chunks");
    for (const auto& [connection, place] : indexed_) {
      if (connections_.count(connection) == 0) {
        throw Fault(false, place, "messages of an unknown connection");
      }
    }
  }

  std::string path_;
  std::ifstream file_;
  std::uint64_t size_;
  std::uint64_t place_ = 0;  // offset of the next read

  std::uint64_t index_ = 0;  // its offset
  std::uint32_t num_connections_ = 0;
  std::uint32_t num_chunks_ = 0;

  // The current record.
  std::uint64_t record_ = 0;  // its offset
  std::uint8_t op_ = 0;
  Fields fields_;
  Part data_{{}, 0};
  std::string header_;
  std::string buffer_;
  std::string chunk_;
  std::string other_chunk_;

  Messages messages_;                          // of the last chunk
  std::map<std::uint64_t, std::uint8_t> ops_;  // of all records, by offset
  std::set<std::uint32_t> connections_;
  std::map<std::uint32_t, std::uint64_t> indexed_;  // connections with their first index record
};

}  // namespace

void check_bag(const std::string& path) {
  try {
    Checker(path).check();
  } catch (const Fault& fault) {
    throw std::runtime_error(path + ": " + fault.what());
  }
}

}  // namespace walker
