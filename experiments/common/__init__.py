"""What several experiments share: options, replays by other people's mechanics, tables."""
