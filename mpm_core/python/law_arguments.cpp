#include "python/law_arguments.h"

#include <algorithm>

namespace mpm::python
{
namespace
{
std::string joined(const std::vector<std::string>& words)
{
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// The names that pass a test
template <class F>
std::string names(const std::vector<Declaration>& declared, F&& passes)
{
  std::vector<std::string> words;
  for (const Declaration& d : declared)
    if (passes(d))
      words.push_back(d.name);
  return joined(words);
}

bool is_part(const Declaration& d) { return !d.unit; }

[[noreturn]] void refuse_unknown(const std::string& law, const std::vector<Declaration>& declared,
                                 const std::string& name, const std::string& all)
{
  py::list known;
  for (const Declaration& d : declared)
    known.append(d.name);
  const py::list near = py::module_::import("difflib").attr("get_close_matches")(name, known, 1);
  const std::string meant = near.empty() ? "." : "; did you mean " + near[0].cast<std::string>() + "?";
  throw InputError(name + " is no parameter of " + law + meant + " " + law + " has " + all);
}

std::string line(const Declaration& d)
{
  std::string text = "    " + d.name + ": " + d.meaning;
  if (d.unit)
    text += " [" + *d.unit + "], " + d.range;
  if (d.standard)
    text += "; by default " + number_text(*d.standard);
  else if (d.unit && !d.needed)
    text += "; by default without limit";
  return text + ".\n";
}
} // namespace

std::string class_text(const std::vector<Declaration>& declared, const std::string& summary, const std::string& remarks)
{
  std::string text = summary + "\n\nArgs:\n";
  for (const Declaration& d : declared)
    text += line(d);
  return remarks.empty() ? text : text + "\n" + remarks + "\n";
}

py::dict named_arguments(const std::string& law, const std::vector<Declaration>& declared, const py::args& args,
                         const py::kwargs& given)
{
  const std::string all = names(declared, [](const Declaration&) { return true; });
  py::dict values;
  const auto parts = static_cast<std::size_t>(std::count_if(declared.begin(), declared.end(), is_part));
  if (args.size() > parts)
    throw InputError(law + " got " + py::repr(args[parts]).cast<std::string>() +
                     " without a name, expected parameters by name, such as " + declared[parts % declared.size()].name +
                     "=. " + law + " has " + all);
  for (std::size_t k = 0; k < args.size(); ++k)
    values[declared[k].name.c_str()] = args[k];
  for (const auto& [key, value] : given)
  {
    const auto name = key.cast<std::string>();
    if (std::none_of(declared.begin(), declared.end(), [&](const Declaration& d) { return d.name == name; }))
      refuse_unknown(law, declared, name, all);
    if (values.contains(key))
      throw InputError(name + " of " + law + " is given twice");
    values[key] = value;
  }
  const std::string missing =
      names(declared, [&](const Declaration& d) { return d.needed && !values.contains(d.name.c_str()); });
  if (!missing.empty())
    throw InputError(law + " lacks " + missing + ". " + law + " has " + all);
  return values;
}

void refuse_argument(const std::string& law, const std::string& name, const py::handle& value,
                     const std::string& expected)
{
  throw InputError(name + " of " + law + " is " + py::repr(value).cast<std::string>() + ", expected " + expected);
}

double number(const std::string& law, const std::string& name, const py::handle& value)
{
  try
  {
    return value.cast<double>();
  }
  catch (const py::cast_error&)
  {
    refuse_argument(law, name, value, "a number");
  }
}
} // namespace mpm::python
