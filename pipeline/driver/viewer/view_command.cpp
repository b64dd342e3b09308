// `drench view`: plays what an output folder holds, in a browser.
#include <fmt/format.h>

#include "pipeline/driver/commands.h"
#include "pipeline/driver/process.h"
#include "pipeline/driver/standard_output.h"
#include "pipeline/driver/viewer/view_server.h"

namespace drench {

void view_command(const std::filesystem::path& folder, int port) {
  ViewServer server(folder, port);
  print(fmt::format("{}\n", server.address()));
  const GracefulStop graceful;
  server.run([] { return !stop_requested(); });
}

}  // namespace drench
