// Runs a transmitter whose shift clock is five times its pixel clock, and keeps what it sends.

#include <cstdint>
#include <cstdlib>
#include <memory>

#include "Vcomponent.h"
#include "verilated.h"

// An assertion of the hardware fails: there is none in a screen.
void vl_stop(const char *, int, const char *) { std::abort(); }

extern "C" void screen_run(uint64_t pixel_clocks, uint8_t *pairs) {
    auto context = std::make_unique<VerilatedContext>();
    auto dut = std::make_unique<Vcomponent>(context.get());
    dut->pixel_rst = dut->shift_rst = 0;
    for (uint64_t pixel = 0; pixel < pixel_clocks; ++pixel) {
        // The pixel clock rises between two rising edges of the shift clock, and is high for two of its five periods.
        for (int phase = 0; phase < 5; ++phase) {
            dut->shift_clk = 0;
            dut->pixel_clk = phase < 2;
            dut->eval();
            *pairs++ = dut->pairs;
            dut->shift_clk = 1;
            dut->eval();
        }
    }
    dut->final();
}
