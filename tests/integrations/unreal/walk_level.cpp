// A level of actors, culled by AOccluderCuller for the tests: walk_level FILE X Y Z YAW FOV NAME... The
// names that are hidden after a tick are printed.
#include "OccluderCuller.h"

#include <cstdlib>
#include <cstring>

int main(int count, char **given)
{
    UWorld world;
    APlayerCameraManager camera = {{std::atof(given[2]), std::atof(given[3]), std::atof(given[4])},
                                   {std::atof(given[5])},
                                   static_cast<float>(std::atof(given[6]))};
    APlayerController player;
    std::vector<AActor> actors(static_cast<std::size_t>(count - 7));
    for (int place = 7; place < count; ++place) {
        AActor &actor = actors[static_cast<std::size_t>(place - 7)];
        const char *tag = std::strchr(given[place], ':');
        actor.Name = tag ? FString(std::string(given[place], std::size_t(tag - given[place]))) : FString(given[place]);
        actor.Tag = tag ? FString(tag + 1) : FString();
        world.Actors.push_back(&actor);
    }
    AOccluderCuller culler;
    culler.World = &world;
    culler.File = given[1];
    culler.BeginPlay();
    if (!culler.bTicks)
        return 1;
    culler.Tick(0.0f); // there is no player yet
    world.Player = &player;
    player.PlayerCameraManager = &camera;
    culler.Tick(0.0f);
    for (const AActor &actor : actors)
        if (actor.bHidden)
            std::printf("hidden %s\n", *actor.Name);
    return 0;
}
