// The job template: by the rules of its specification, and carried out as a worker would.
#include "pipeline/driver/farm/openjd.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/driver/tiny_shot.h"
#include "tests/driver/toy_shot.h"

namespace drench {
namespace {

using namespace test;
using nlohmann::json;

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (size_t at = text.find(what); at != text.npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

/// Values of a step's parameter, one a task; a step without one has one task.
std::vector<std::string> tasks_of(const json& step) {
  if (!step.contains("parameterSpace")) return {""};
  return step["parameterSpace"]["taskParameterDefinitions"][0]["range"];
}

/// Template Schemas 2023-09, sections 1.1, 2, 3 and 7.1.
void expect_by_the_specification(const json& job) {
  EXPECT_EQ(job["specificationVersion"], "jobtemplate-2023-09");
  const std::string name = job["name"];
  EXPECT_TRUE(!name.empty() && name.size() <= 128) << name;
  const std::regex identifier("[A-Za-z_][A-Za-z0-9_]{0,63}");
  std::set<std::string> parameters, steps;
  for (const json& parameter : job["parameterDefinitions"]) {
    EXPECT_TRUE(std::regex_match(parameter["name"].get<std::string>(), identifier));
    EXPECT_TRUE(parameters.insert(parameter["name"]).second) << parameter;
  }
  for (const json& step : job["steps"]) {
    EXPECT_LE(step["name"].get<std::string>().size(), 64u);
    // Those that it waits for are other steps; here they come before it, so that none is a circle.
    EXPECT_NE(step.value("dependencies", json::array({1})), json::array());
    for (const json& before : step.value("dependencies", json::array()))
      EXPECT_TRUE(steps.contains(before["dependsOn"])) << step["name"] << before;
    EXPECT_TRUE(steps.insert(step["name"]).second) << step["name"];
    const std::vector<std::string> tasks = tasks_of(step);
    EXPECT_TRUE(!tasks.empty() && tasks.size() <= 1024u) << tasks.size();
    std::string words = step["script"]["actions"]["onRun"]["command"];
    for (const json& word : step["script"]["actions"]["onRun"]["args"])
      words.append(" ").append(word.get<std::string>());
    for (const std::string& parameter : parameters)
      words = replaced(words, "{{Param." + parameter + "}}", "");
    if (step.contains("parameterSpace")) words = replaced(words, "{{Task.Param.Frames}}", "");
    EXPECT_EQ(words.find("{{"), words.npos) << words;
  }
}

TEST(OpenjdTemplate, KeepsToTheSpecificationForAnyShot) {
  for (const int frames : {1, 2, 25, 3000}) {
    ToySettings settings;
    settings.last = frames;
    settings.foam = true, settings.denoise_frames = 1;
    settings.steps = all_steps();
    const Targets targets = toy_targets(settings);
    const int chunk = 1 + frames / openjd_most_tasks;
    const FarmGraph graph = farm_graph(targets, make_plan(targets, {}, frames), chunk);
    expect_by_the_specification(json::parse(openjd_template(graph, {.name = std::string(300, 'x'),
                                                                    .program = "drench",
                                                                    .shot = "a b.toml",
                                                                    .folder = "out",
                                                                    .cuda = true,
                                                                    .cores = 4})));
  }
}

TEST(OpenjdTemplate, CarriedOutStepByStepMakesTheShot) {
  const TinyShot shot(4);
  const Ended ended = shot.run("farm", {"--template", "openjd", "--chunk", "3"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const json job = json::parse(ended.out);
  expect_by_the_specification(job);
  for (const json& step : job["steps"])
    for (const std::string& frames : tasks_of(step)) {
      std::vector<std::string> words{step["script"]["actions"]["onRun"]["command"]};
      for (const json& word : step["script"]["actions"]["onRun"]["args"]) words.push_back(word);
      for (std::string& word : words) {
        for (const json& parameter : job["parameterDefinitions"])
          word = replaced(word, "{{Param." + parameter["name"].get<std::string>() + "}}",
                          parameter["default"]);
        word = replaced(word, "{{Task.Param.Frames}}", frames);
      }
      const Ended task = run_program(words[0], {words.begin() + 1, words.end()}, shot.folder());
      EXPECT_EQ(task.code, 0) << task.err;
      EXPECT_NE(task.out.find("openjd_progress: 100.0"), std::string::npos) << task.out;
    }
  EXPECT_EQ(shot.digests(), undisturbed_digests(4));
}

}  // namespace
}  // namespace drench
