// A locale in which C functions write 0,5 and C++ streams write 1.234,5.
#pragma once

#include <clocale>
#include <cstdlib>
#include <locale>
#include <stdexcept>
#include <string>

#include "temporary_folder.h"

namespace walker {

/// Sets the process's C and C++ locale to German while the object exists. It is compiled from the
/// sources in the distribution's package locales, so it need not be installed.
class ForeignLocale {
 public:
  ForeignLocale() {
    const std::string name = "de_DE.UTF-8";
    const std::string command = "localedef -i de_DE -f UTF-8 " + folder_.path(name);
    if (std::system(command.c_str()) != 0) {  // NOLINT: of constants and our own folder
      throw std::runtime_error(command + ": fails; is the package locales installed?");
    }
    setenv("LOCPATH", folder_.path().c_str(), 1);      // NOLINT(concurrency-mt-unsafe)
    before_ = std::locale::global(std::locale(name));  // sets C's too, because it has a name
  }
  ForeignLocale(const ForeignLocale&) = delete;
  ForeignLocale& operator=(const ForeignLocale&) = delete;
  ~ForeignLocale() { std::locale::global(before_); }

 private:
  Folder folder_;
  std::locale before_;
};

}  // namespace walker
