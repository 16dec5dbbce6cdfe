"""What the chip is built for: devices and boards, and the open tools that get it there."""
