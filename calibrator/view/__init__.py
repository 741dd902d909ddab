"""One run to be seen: made again with snapshots, as a picture, an animation and for ParaView."""
