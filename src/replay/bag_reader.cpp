#include "replay/bag_reader.h"

#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <rosbag/chunked_file.h>
#include <rosbag/constants.h>

#include "ros/checked_message.h"
#include "wire/tcpros.h"

namespace walker {
namespace {

// Format: wiki.ros.org/Bags/Format/2.0

constexpr std::size_t kMaxRecordBytes = std::size_t{1} << 28U;

const std::uint8_t* bytes_of(std::string_view text) {
  return reinterpret_cast<const std::uint8_t*>(text.data());
}

tcpros::Fields parse_fields(std::string_view header) {
  return tcpros::parse_header(bytes_of(header), header.size());
}

template <typename Number>
Number number(const tcpros::Fields& fields, const std::string& name) {
  const auto found = fields.find(name);
  if (found == fields.end() || found->second.size() != sizeof(Number)) {
    throw std::runtime_error("a record without a valid field " + name);
  }
  return MessageReader(bytes_of(found->second), sizeof(Number), "a field").number<Number>();
}

std::string text(const tcpros::Fields& fields, const std::string& name) {
  const auto found = fields.find(name);
  return found == fields.end() ? "" : found->second;
}

class BagReader {
 public:
  BagReader(const std::string& path, const std::function<void(const BagEpisode&)>& visit)
      : path_(path),
        visit_(visit),
        file_(path, std::ios::binary),
        size_(std::filesystem::file_size(path)) {}

  bool read() {
    const std::string version = "#ROSBAG V" + rosbag::VERSION;
    if (read_bytes(version.size() + 1) != version + "\n") {
      throw std::runtime_error("must begin with " + version);
    }
    while (place_ < size_) {
      record_ = place_;
      std::string data;
      tcpros::Fields fields;
      try {
        const std::string header = read_block();
        fields = parse_fields(header);
        number<std::uint8_t>(fields, rosbag::OP_FIELD_NAME);
        data = read_block();
      } catch (const std::exception&) {
        if (is_closed_) throw;
        return false;  // the record that was being written
      }
      read_record(fields, data);
    }
    return is_closed_;
  }

  /// Offset of the current record.
  std::uint64_t record() const { return record_; }

 private:
  struct Connection {
    std::string publisher;
    bool has_episodes = false;
  };

  std::string read_bytes(std::size_t size) {
    if (size > size_ - place_) throw std::runtime_error("the file ends within a record");
    if (size > kMaxRecordBytes) {
      throw std::runtime_error("a record of " + std::to_string(size) + " bytes; at most " +
                               std::to_string(kMaxRecordBytes) + " are read");
    }
    std::string bytes(size, '\0');
    if (!file_.read(bytes.data(), static_cast<std::streamsize>(size))) {
      throw std::runtime_error("cannot be read");
    }
    place_ += size;
    return bytes;
  }

  /// Reads a length and as many bytes.
  std::string read_block() {
    const std::string length = read_bytes(tcpros::kLengthBytes);
    return read_bytes(tcpros::load_length(bytes_of(length)));
  }

  void read_record(const tcpros::Fields& fields, std::string_view data) {
    switch (const auto op = number<std::uint8_t>(fields, rosbag::OP_FIELD_NAME)) {
      case rosbag::OP_FILE_HEADER:
        is_closed_ = number<std::uint64_t>(fields, rosbag::INDEX_POS_FIELD_NAME) != 0;
        if (!text(fields, rosbag::ENCRYPTOR_FIELD_NAME).empty()) {
          throw std::runtime_error("encrypted; must be a plain bag");
        }
        break;
      case rosbag::OP_CHUNK:
        read_chunk(uncompressed(fields, data));
        break;
      case rosbag::OP_CONNECTION:
        read_connection(fields, parse_fields(data));
        break;
      case rosbag::OP_MSG_DATA:
        read_message(fields, data);
        break;
      case rosbag::OP_INDEX_DATA:
      case rosbag::OP_CHUNK_INFO:
        break;
      default:
        throw std::runtime_error("a record of unknown kind " + std::to_string(op));
    }
  }

  void read_chunk(std::string_view chunk) {
    MessageReader reader(bytes_of(chunk), chunk.size(), "a chunk");
    while (reader.size() > 0) {
      const tcpros::Fields fields = parse_fields(reader.text());
      if (number<std::uint8_t>(fields, rosbag::OP_FIELD_NAME) == rosbag::OP_CHUNK) {
        throw std::runtime_error("a chunk in a chunk");
      }
      read_record(fields, reader.text());
    }
  }

  std::string_view uncompressed(const tcpros::Fields& fields, std::string_view data) {
    const std::string compression = text(fields, rosbag::COMPRESSION_FIELD_NAME);
    if (compression == rosbag::COMPRESSION_NONE || data.empty()) return data;
    const bool is_bz2 = compression == rosbag::COMPRESSION_BZ2;
    if (!is_bz2 && compression != rosbag::COMPRESSION_LZ4) {
      throw std::runtime_error("a chunk with an unknown compression");
    }
    const auto size = number<std::uint32_t>(fields, rosbag::SIZE_FIELD_NAME);
    if (size > kMaxRecordBytes) {
      throw std::runtime_error("a chunk of " + std::to_string(size) + " bytes; at most " +
                               std::to_string(kMaxRecordBytes) + " are read");
    }
    // rosbag does not report how many bytes it wrote; zeros that remain are not a valid record.
    chunk_.assign(size, '\0');
    std::string source(data);
    rosbag::ChunkedFile decompressor;
    decompressor.openRead(path_);
    decompressor.decompress(is_bz2 ? rosbag::compression::BZ2 : rosbag::compression::LZ4,
                            reinterpret_cast<std::uint8_t*>(chunk_.data()), size,
                            reinterpret_cast<std::uint8_t*>(source.data()),
                            static_cast<unsigned int>(source.size()));
    return chunk_;
  }

  void read_connection(const tcpros::Fields& fields, const tcpros::Fields& header) {
    using Traits = ros::message_traits::MD5Sum<walker_sim::EpisodeRecord>;
    Connection& connection =
        connections_[number<std::uint32_t>(fields, rosbag::CONNECTION_FIELD_NAME)];
    const std::string topic = text(fields, rosbag::TOPIC_FIELD_NAME);
    const std::string type = ros::message_traits::datatype<walker_sim::EpisodeRecord>();
    const std::string node = text(header, "callerid");
    connection.publisher = node.empty() ? topic : node;
    connection.has_episodes = text(header, "type") == type;
    const std::string md5 = text(header, "md5sum");
    if (!connection.has_episodes || md5 == Traits::value()) return;
    throw std::runtime_error("topic " + topic + ": " + type + " has the MD5 " + md5 +
                             "; here it is " + Traits::value() +
                             ", so another version of walker_sim recorded it");
  }

  void read_message(const tcpros::Fields& fields, std::string_view data) {
    const auto connection =
        connections_.find(number<std::uint32_t>(fields, rosbag::CONNECTION_FIELD_NAME));
    if (connection == connections_.end()) {
      throw std::runtime_error("a message of an unknown connection");
    }
    if (!connection->second.has_episodes) return;
    BagEpisode episode;
    episode.publisher = connection->second.publisher;
    // Seconds in the lower half, nanoseconds in the upper one.
    const auto time = number<std::uint64_t>(fields, rosbag::TIME_FIELD_NAME);
    episode.time = (time << 32U) | (time >> 32U);
    episode.hash = std::hash<std::string_view>()(data);
    read_exactly(bytes_of(data), data.size(), "an episode's record", episode.record);
    visit_(episode);
  }

  std::string path_;
  const std::function<void(const BagEpisode&)>& visit_;
  std::ifstream file_;
  std::uint64_t size_;
  std::uint64_t place_ = 0;  // offset of the next read
  std::uint64_t record_ = 0;
  bool is_closed_ = true;
  std::string chunk_;  // decompressed
  std::map<std::uint32_t, Connection> connections_;
};

}  // namespace

bool read_episodes(const std::string& path, const std::function<void(const BagEpisode&)>& visit) {
  if (!std::filesystem::exists(path)) throw std::runtime_error(path + ": no such file");
  if (!std::filesystem::is_regular_file(path)) throw std::runtime_error(path + ": is not a file");
  BagReader reader(path, visit);
  try {
    return reader.read();
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": is not a bag, or is damaged or cut off: at byte " +
                             std::to_string(reader.record()) + ": " + error.what());
  }
}

}  // namespace walker
