#include "../../../firmware/biotac_bridge/biotac_bridge.ino"

int main() {
  setup();
  for (;;) loop();
}
