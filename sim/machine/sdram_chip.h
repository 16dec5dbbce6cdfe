// An SDRAM chip for Verilated benches, which refuses what its datasheet forbids; see sdram_chip.py for what is modelled.
//
// Times are the datasheets' own: Alliance Memory, AS4C16M16SA-C&I, rev. 3.0, March 2015, table 16; Micron, 256Mb: x4, x8,
// x16 SDRAM, MT48LC16M16A2, AC characteristics, speed grade -75.

#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace sdram {

struct Datasheet {
    const char* name;
    double tck2, tck3, trcd, trp, tras, tras_max, trc, trrd, twr, trfc, tmrd, power_up;
};

// Times in ns; tck2 and tck3 are the shortest periods at CAS latency 2 and 3.
constexpr Datasheet datasheets[] = {
    {"AS4C16M16SA-6", 10, 6, 18, 18, 42, 120e3, 60, 12, 12, 60, 12, 200e3},
    {"AS4C16M16SA-7", 10, 7, 21, 21, 42, 120e3, 63, 14, 14, 63, 14, 200e3},
    {"MT48LC16M16A2-75", 10, 7.5, 20, 20, 44, 120e3, 66, 15, 15, 66, 15, 100e3},
};

struct Pins {
    bool cke, cs_n, ras_n, cas_n, we_n, dq_oe;
    unsigned ba, a, dqm, dq;
};

class Chip {
  public:
    static constexpr int num_banks = 4, num_rows = 8192, num_columns = 512, init_refreshes = 2, owed = 8;
    static constexpr double refresh_period = 64e6;
    static constexpr uint16_t nothing = 0x5A5A;

    uint64_t cycle = 0, violations = 0, data_cycles = 0, refreshes = 0, activations = 0, reads = 0, writes = 0;
    std::string first_violation;
    std::vector<uint16_t> contents = std::vector<uint16_t>(size_t(num_banks) * num_rows * num_columns);

    Chip(const Datasheet& sheet, double period, double power_up = -1) : sheet(sheet), period(period) {
        power_up_cycles = cycles(power_up < 0 ? sheet.power_up : power_up);
        rcd = cycles(sheet.trcd), rp = cycles(sheet.trp), ras = cycles(sheet.tras), rc = cycles(sheet.trc);
        rrd = cycles(sheet.trrd), wr = cycles(sheet.twr), rfc = cycles(sheet.trfc), mrd = cycles(sheet.tmrd);
        ras_max = int64_t(sheet.tras_max / period);
        if (period < std::min(sheet.tck2, sheet.tck3)) refuse("tCK", -1, "the period is too short");
    }

    static size_t place(unsigned bank, unsigned row, unsigned column) {
        return (size_t(bank) * num_rows + row) * num_columns + column;
    }

    // A 32-bit word, where rows of consecutive kilobytes are in consecutive banks.
    uint32_t word(uint32_t address) const {
        size_t at = place(address >> 8 & 3, address >> 10, (address & 255) << 1);
        return contents[at] | uint32_t(contents[at + 1]) << 16;
    }

    // One rising edge; returns what is on the data lines at the next one.
    uint16_t edge(const Pins& pins) {
        Slot& now = coming[cycle % length];
        bool drives = now.valid;
        now.valid = false;
        if (mode_set > long_ago && !pins.cke) refuse("CKE", -1, "low; power-down is not modelled");
        if (pins.dq_oe && drives) refuse("contention", -1, "chip and controller drive the data lines");
        if (pins.dq_oe && drove) refuse("contention", -1, "the controller drives while the chip is letting go (tHZ)");
        drove = drives;
        if (refresh_due >= 0 && double(cycle) * period > refresh_due) {
            refuse("tREF", -1, "8 refreshes are owed");
            refresh_due = -1;
        }
        unsigned command = pins.ras_n << 2 | pins.cas_n << 1 | pins.we_n;
        if (!pins.cs_n && pins.cke && command != 7) obey(command, pins.ba, pins.a);
        bool moved = drives || write_left > 0;
        if (write_left > 0) store(pins);
        data_cycles += moved;
        ++cycle;
        const Slot& next = coming[cycle % length];
        unsigned keep = (mask & 1 ? 0 : 0xFF) | (mask & 2 ? 0 : 0xFF00);
        mask = pins.dqm;
        return next.valid ? (next.value & keep) | (nothing & ~keep) : nothing;
    }

  private:
    static constexpr int64_t long_ago = -(int64_t(1) << 60);
    static constexpr int length = 32;
    struct Bank {
        int64_t activated = long_ago, precharged = long_ago, written = long_ago;
        int row = -1;
    };
    struct Slot {
        bool valid = false;
        uint16_t value = 0;
        unsigned bank = 0;
    };

    const Datasheet& sheet;
    double period, refresh_due = -1;
    int64_t power_up_cycles, rcd, rp, ras, ras_max, rc, rrd, wr, rfc, mrd;
    Bank banks[num_banks];
    Slot coming[length];
    int64_t activated = long_ago, refreshed = long_ago, mode_set = long_ago;
    bool closed_at_all = false, drove = false;
    int latency = 0, burst = 1, num_init = 0, write_left = 0;
    unsigned write_bank = 0, write_column = 0, mask = 0;
    std::vector<double> refresh_times = std::vector<double>(num_rows, -1);

    int64_t cycles(double time) const {
        int64_t whole = int64_t(time / period);
        return double(whole) * period < time - 1e-6 ? whole + 1 : whole;
    }

    void refuse(const char* rule, int bank, const std::string& why) {
        if (!violations++)
            first_violation = std::string(rule) + ": " + (bank < 0 ? "all banks" : "bank " + std::to_string(bank)) +
                              ", cycle " + std::to_string(cycle) + ": " + why;
    }

    void wait(const char* rule, int bank, int64_t since, int64_t least, const char* what) {
        if (int64_t(cycle) - since < least)
            refuse(rule, bank, std::string(what) + " after " + std::to_string(int64_t(cycle) - since) +
                                   " cycles; at least " + std::to_string(least));
    }

    void store(const Pins& pins) {
        if (pins.dqm != 3) {
            if (!pins.dq_oe) refuse("data", write_bank, "a word is written that nobody drives");
            uint16_t& cell = contents[place(write_bank, banks[write_bank].row, write_column)];
            unsigned keep = (pins.dqm & 1 ? 0xFF : 0) | (pins.dqm & 2 ? 0xFF00 : 0);
            cell = uint16_t((cell & keep) | (pins.dq & ~keep));
        }
        banks[write_bank].written = cycle;
        write_column = (write_column & ~unsigned(burst - 1)) | ((write_column + 1) & unsigned(burst - 1));
        --write_left;
    }

    void obey(unsigned command, unsigned number, unsigned a) {
        static const char* const names[] = {"LOAD MODE REGISTER", "AUTO REFRESH", "PRECHARGE", "ACTIVE", "WRITE",
                                            "READ", "BURST TERMINATE"};
        const char* what = names[command];
        if (int64_t(cycle) < power_up_cycles) refuse("power-up", -1, what);
        if (!closed_at_all && !(command == 2 && a >> 10 & 1))
            refuse("initialization", -1, std::string(what) + " before all banks were precharged");
        if ((mode_set == long_ago || num_init < init_refreshes) && command >= 3)
            refuse("initialization", number, std::string(what) + " before refreshes and the mode");
        wait("tRFC", number, refreshed, rfc, what);
        wait("tMRD", number, mode_set, mrd, what);
        Bank& bank = banks[number];
        switch (command) {
        case 0:
            all_idle(what);
            burst = 1 << (a & 7), latency = a >> 4 & 7;
            if (number || (a & 7) > 3 || a & 8 || latency < 2 || latency > 3 || a >> 7) {
                refuse("mode", -1, "reserved or not modelled");
                burst = 1, latency = 3;
            }
            if (period < (latency == 2 ? sheet.tck2 : sheet.tck3) - 1e-6) refuse("tCK", -1, "CAS latency too short");
            mode_set = cycle;
            break;
        case 1:
            all_idle(what);
            refresh();
            break;
        case 2:
            closed_at_all |= a >> 10 & 1;
            for (unsigned each = 0; each < num_banks; ++each)
                if ((a >> 10 & 1) || each == number) precharge(each, what);
            break;
        case 3:
            if (bank.row >= 0) refuse("state", number, "ACTIVE while a row is open");
            wait("tRP", number, bank.precharged, rp, what);
            wait("tRC", number, bank.activated, rc, what);
            wait("tRRD", number, activated, rrd, what);
            bank.row = a, bank.activated = activated = cycle;
            ++activations;
            break;
        case 4:
            if (!column(number, a, what)) break;
            for (int offset = 0; offset < latency + 8; ++offset)
                if (coming[(cycle + offset) % length].valid)
                    refuse("contention", number, "WRITE while words are still to come");
            write_bank = number, write_column = a & (num_columns - 1), write_left = burst;
            ++writes;
            break;
        case 5:
            if (!column(number, a, what)) break;
            write_left = 0;
            cut(-1);
            for (int beat = 0; beat < burst; ++beat) {
                unsigned at = (a & (num_columns - 1) & ~unsigned(burst - 1)) | ((a + beat) & unsigned(burst - 1));
                coming[(cycle + latency + beat) % length] = {true, contents[place(number, bank.row, at)], number};
            }
            ++reads;
            break;
        default:
            refuse("state", -1, "BURST TERMINATE is not modelled");
        }
    }

    void all_idle(const char* what) {
        for (int number = 0; number < num_banks; ++number) {
            if (banks[number].row >= 0) refuse("state", number, std::string(what) + " while a row is open");
            wait("tRP", number, banks[number].precharged, rp, what);
            wait("tRC", number, banks[number].activated, rc, what);
        }
    }

    void refresh() {
        double now = double(cycle) * period, interval = refresh_period / num_rows;
        double& before = refresh_times[refreshes % num_rows];
        if (before >= 0 && now - before > refresh_period) refuse("tREF", -1, "8192 refreshes took longer than 64 ms");
        before = now;
        ++refreshes, ++num_init;
        refreshed = cycle;
        double due = refresh_due < 0 ? now : refresh_due - owed * interval;
        refresh_due = std::min(due + interval, now + owed * interval) + owed * interval;
    }

    void precharge(unsigned number, const char* what) {
        Bank& bank = banks[number];
        if (bank.row < 0) {
            bank.precharged = cycle;
            return;
        }
        wait("tRAS", number, bank.activated, ras, what);
        if (int64_t(cycle) - bank.activated > ras_max) refuse("tRAS max", number, "a row was open too long");
        if (write_left > 0 && write_bank == number) refuse("tWR", number, "PRECHARGE before the burst is written");
        wait("tWR", number, bank.written, wr, what);
        bank.row = -1, bank.precharged = cycle;
        cut(number);
    }

    bool column(unsigned number, unsigned a, const char* what) {
        if (banks[number].row < 0) {
            refuse("state", number, std::string(what) + " while no row is open");
            return false;
        }
        if (a >> 10 & 1) refuse("state", number, "automatic precharge is not modelled");
        wait("tRCD", number, banks[number].activated, rcd, what);
        return true;
    }

    // Words of reads begun before, of one bank or all, no longer come CAS latency cycles from now.
    void cut(int number) {
        for (int offset = latency; offset < latency + 8; ++offset) {
            Slot& slot = coming[(cycle + offset) % length];
            if (number < 0 || slot.bank == unsigned(number)) slot.valid = false;
        }
    }
};

}  // namespace sdram
