// A locale in which C's functions write 0,5 and C++'s streams 1.234,5.
#pragma once

#include <clocale>
#include <cstdlib>
#include <locale>
#include <stdexcept>
#include <string>

#include "temporary_folder.h"

namespace walker {

/// The process's German locale, in C and in C++, as long as the object lives. No system has to have
/// it: the distribution's package locales brings what it is made of.
class ForeignLocale {
 public:
  ForeignLocale() {
    const std::string name = "de_DE.UTF-8";
    const std::string command = "localedef -i de_DE -f UTF-8 " + folder_.path(name);
    if (std::system(command.c_str()) != 0) {  // NOLINT: of constants and our own folder
      throw std::runtime_error(command + ": fails; is the package locales installed?");
    }
    setenv("LOCPATH", folder_.path().c_str(), 1);      // NOLINT(concurrency-mt-unsafe)
    before_ = std::locale::global(std::locale(name));  // of C as well, for it has a name
  }
  ForeignLocale(const ForeignLocale&) = delete;
  ForeignLocale& operator=(const ForeignLocale&) = delete;
  ~ForeignLocale() { std::locale::global(before_); }

 private:
  Folder folder_;
  std::locale before_;
};

}  // namespace walker
